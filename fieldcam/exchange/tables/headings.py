"""Finds a sheet's heading, which titles may stand above and a second row may complete."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from fieldcam.errors import BadInput
from fieldcam.exchange.tables.dates import is_day
from fieldcam.exchange.tables.sheets import Sheet, SheetRow
from fieldcam.foreign.bounds import MAX_TITLE_ROWS

UNITS = {
    "cm": "centimetres",
    **dict.fromkeys(("in", "inch", "inches", '"', "\u2033"), "inches"),
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm"), "micrometres"),
}
"""Of lengths, as headings name them and as people say them; mm need no name."""
_ANY_UNIT = "|".join(("mm", *UNITS))
_UNIT = re.compile(rf"[(\[]?({_ANY_UNIT})[)\]]?")
_UNIT_BEHIND = re.compile(rf"(?: in)?(?:[._, ]*[(\[]|[., ]+)({_ANY_UNIT})[)\]]?$")
_NUMBER_BEHIND = re.compile(r"_(?:no|nr|num|number|#)\.?$|#$")
IsHeading = Callable[[Sequence[str]], bool]
"""Of the names that `column_names` gives."""


@dataclass(frozen=True, slots=True)
class TableRow:
    """One row below the heading."""

    sheet: Sheet
    columns: dict[str, int]
    number: int
    cells: dict[str, str]
    """By column."""

    @property
    def place(self) -> str:
        """Of the row, for complaints about it."""
        return self.sheet.row_place(self.number)

    def cell_place(self, column: str) -> str:
        return self.sheet.cell_place(self.number, self.columns[column], column)


@dataclass(frozen=True, slots=True)
class Table:
    """A heading and the rows below it."""

    sheet: Sheet
    heading: int
    """Number of its row."""
    columns: dict[str, int]
    """Where each stands, by its name: lower case, without units. The first of equal names."""
    twice: frozenset[str]
    """Names that more than one column has."""
    rows: tuple[TableRow, ...]
    titles: tuple[str, ...]
    """What stands above the heading."""

    @property
    def name(self) -> str:
        return self.sheet.name

    def heading_place(self, column: str) -> str:
        return self.sheet.cell_place(self.heading, self.columns[column], column)

    def column(self, names: Sequence[str]) -> str | None:
        """The first of these names that there is; raises BadInput where two columns have it."""
        found = next((name for name in names if name in self.columns), None)
        if found is not None:
            self.check_once(found)
        return found

    def check_once(self, name: str) -> None:
        """Raises BadInput where more than one column has this name."""
        if name in self.twice:
            place = self.sheet.row_place(self.heading)
            raise BadInput(f"{place}: there are two columns {name}.")


def find_table(sheet: Sheet, is_heading: IsHeading) -> Table | None:
    """The table of a sheet; None where no row near its top is such a heading.

    Raises BadInput for a row that is longer than the heading.
    """
    for place, length, names in _candidates(sheet.rows):
        if is_heading([name for name in names if name]):
            return table_of(sheet, place, length, names)
    return None


def column_names(cells: Sequence[str]) -> list[str]:
    """In lower case with underscores; a unit other than mm behind a name becomes a part of it."""
    return [_column_name(cell) for cell in cells]


def _column_name(cell: str) -> str:
    written = cell.lower().strip()
    unit = _UNIT_BEHIND.search(written)
    name = re.sub(r"\s+", "_", _UNIT_BEHIND.sub("", written).strip())
    name = _NUMBER_BEHIND.sub("", name)
    return f"{name}_{unit[1]}" if unit and unit[1] in UNITS else name


def _candidates(rows: Sequence[SheetRow]) -> Iterator[tuple[int, int, list[str]]]:
    """Where a heading may begin, how many rows it has, and its names."""
    for place, row in enumerate(rows[: MAX_TITLE_ROWS + 1]):
        if place + 1 < len(rows) and (names := _joined(row.cells, rows[place + 1].cells)):
            yield place, 2, names
        yield place, 1, column_names(row.cells)


def _joined(upper: Sequence[str], lower: Sequence[str]) -> list[str]:
    """Names that two rows say together: units below names, measures below dates, or the reverse.

    Empty where the lower row is no second row of a heading.
    """
    width = max(len(upper), len(lower))
    above = [*upper, *[""] * (width - len(upper))]
    below = [*lower, *[""] * (width - len(lower))]
    if all(_UNIT.fullmatch(cell.lower()) for cell in below if cell):
        units = [f" ({cell.lower().strip('()[]')})" if cell else "" for cell in below]
        return column_names([one + unit for one, unit in zip(above, units, strict=True)])
    if not any(map(is_day, [*above, *below])) or any(map(_is_number, below)):
        return []
    return column_names(list(_with_dates(above, below)))


def _with_dates(above: Sequence[str], below: Sequence[str]) -> Iterator[str]:
    """The upper name goes for all columns up to the next one, as merged cells are written."""
    carried = ""
    for one, two in zip(above, below, strict=True):
        carried = one if one else carried
        if two and is_day(carried):
            yield _measured_on(two, carried)
        elif carried and is_day(two):
            yield _measured_on(carried, two)
        else:
            yield two or one


def _measured_on(name: str, day: str) -> str:
    """Such as diam.2026-05-10; a unit goes behind."""
    unit = _UNIT_BEHIND.search(name.lower())
    return f"{_UNIT_BEHIND.sub('', name.lower())}.{day}{unit[0] if unit else ''}"


def _is_number(cell: str) -> bool:
    return bool(re.fullmatch(r"[+-]?\d+(?:[.,]\d+)?", cell)) and not is_day(cell)


def table_of(sheet: Sheet, place: int, length: int, names: list[str]) -> Table:
    """The table whose heading is `length` rows from the one at `place` on, with these names."""
    heading = sheet.rows[place].number
    columns = {name: names.index(name) for name in names if name}
    twice = frozenset(name for name in columns if names.count(name) > 1)
    width = len(names)
    # Lists of many sheets of paper repeat their heading.
    below = (row for row in sheet.rows[place + length :] if column_names(row.cells) != names)
    rows = tuple(_row(sheet, columns, width, row) for row in below)
    titles = tuple(" ".join(filter(None, row.cells)) for row in sheet.rows[:place])
    return Table(sheet, heading, columns, twice, rows, titles)


def _row(sheet: Sheet, columns: dict[str, int], width: int, row: SheetRow) -> TableRow:
    if len(row.cells) > width:
        raise _too_long(sheet, width, row)
    padded = [*row.cells, *[""] * (width - len(row.cells))]
    return TableRow(sheet, columns, row.number, {name: padded[i] for name, i in columns.items()})


def _too_long(sheet: Sheet, width: int, row: SheetRow) -> BadInput:
    place, filled = sheet.row_place(row.number), len(row.cells)
    if sheet.separator == "," and all(map(_is_number, row.cells[-2:])):
        return BadInput(
            f"{place}: there are {filled} cells below {width} headings; are commas used both as"
            " decimals and between the cells?",
            "Save the table with semicolons between the cells, or with points as decimals.",
        )
    return BadInput(
        f"{place}: there are {filled} cells below {width} headings; the last is {row.cells[-1]!r}.",
        "Give each column a heading, or empty what stands beside the table.",
    )
