"""Cells out of the shapes that caliper tables have: long, wide, the peers', the authors'."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date

from fieldcam.errors import BadInput
from fieldcam.exchange.calipers.cells import label_of, whole_of
from fieldcam.exchange.calipers.columns import (
    CERTAINTY,
    CLUSTER,
    DATE,
    DIAMETER,
    FRUIT,
    MEASURED_BY,
    SHAPES,
    STATE,
    authors_fruit,
    is_visit_number,
    visit_columns,
)
from fieldcam.exchange.tables.dates import WrittenDate, is_day
from fieldcam.exchange.tables.headings import Table, TableRow
from fieldcam.exchange.tables.merged import Repeated, filled_down
from fieldcam.exchange.tables.trees import ROW, TREE, StandingTree
from fieldcam.growth.records import SizeSource, fruit_name
from fieldcam.words import number_of


@dataclass(frozen=True, slots=True)
class SaidCell:
    """What a column beside the sizes says, such as a state, and where."""

    text: str
    place: str


@dataclass(frozen=True, slots=True)
class CaliperCell:
    """One cell of a size, before the whole file says what its date and words mean."""

    place: str
    tree: StandingTree
    cluster: int
    fruit: str
    """Empty where fruits have no names."""
    day: WrittenDate
    text: str
    source: SizeSource
    state: SaidCell | None = None
    certainty: SaidCell | None = None
    """Of the match, 0 to 1, where the table was made from a camera's sizes."""


@dataclass(frozen=True, slots=True)
class CaliperCells:
    """The cells of one sheet, and what was assumed to tell them apart."""

    cells: tuple[CaliperCell, ...]
    notes: tuple[str, ...]


def cells_of(table: Table, dates: Sequence[date]) -> CaliperCells:
    """All cells of sizes; `dates` are those of numbered visits.

    Raises BadInput for a heading that lacks a column, and for each bad cell.
    """
    cluster = _needed(table, CLUSTER)
    rows, merged = _rows(table, cluster)
    cells = tuple(_cells(table, rows, cluster, dates))
    titles = f"Passed over above the heading: {'; '.join(table.titles)}." if table.titles else ""
    return CaliperCells(cells, tuple(filter(None, (titles, merged))))


def has_dates(table: Table) -> bool:
    """Whether it can be told when it was measured."""
    named = table.sheet.title is not None and is_day(table.sheet.title)
    return named or bool(visit_columns(table)) or table.column(DATE) is not None


def _rows(table: Table, cluster: str) -> tuple[list[TableRow], str]:
    whole = [table.column(ROW), table.column(TREE), cluster]
    repeated = Repeated([name for name in whole if name], _dates(table), table.column(FRUIT))
    return filled_down(table, repeated)


def _cells(
    table: Table, rows: Sequence[TableRow], cluster: str, dates: Sequence[date]
) -> Iterator[CaliperCell]:
    visits = visit_columns(table)
    if visits and all(map(is_visit_number, visits)):
        yield from _wide(table, rows, cluster, _numbered(table, visits, dates))
        return
    if dates:
        raise BadInput(f"{table.name} names its own dates.", "Leave out --dates.")
    fruit = {name: fruit_name(name) for name in authors_fruit(table)}
    if visits:
        yield from _wide(table, rows, cluster, _dated(table, visits))
    elif fruit:
        yield from _of_authors(table, rows, cluster, fruit)
    else:
        yield from _long(table, rows, cluster)


def _of_authors(
    table: Table, rows: Sequence[TableRow], cluster: str, fruit: Mapping[str, str]
) -> Iterator[CaliperCell]:
    """Columns tag, fl1 ... flN; the date is the sheet's, or stands in a column."""
    places: dict[tuple[int, str], str] = {}
    for row in rows:
        tag, day = whole_of(row.cells[cluster], row.place, "tag"), _day(table, row)
        if (tag, day.text) in places:
            raise BadInput(f"{row.place}: tag {tag} is in {places[tag, day.text]} already.")
        places[tag, day.text] = row.place.rpartition(", ")[2]
        for column, name in fruit.items():
            yield _cell(table, row, column, tag, name, day)


def _long(table: Table, rows: Sequence[TableRow], cluster: str) -> Iterator[CaliperCell]:
    diameter, fruit = _needed(table, DIAMETER), table.column(FRUIT)
    for row in rows:
        name = fruit_name(row.cells[fruit]) if fruit else ""
        tag = whole_of(row.cells[cluster], row.place, "cluster")
        yield _cell(table, row, diameter, tag, name, _day(table, row))


def _wide(
    table: Table, rows: Sequence[TableRow], cluster: str, days: Mapping[str, WrittenDate]
) -> Iterator[CaliperCell]:
    fruit = _needed(table, FRUIT)
    states, certainties = _said(table, STATE), _said(table, CERTAINTY)
    for row in rows:
        tag = whole_of(row.cells[cluster], row.place, "cluster")
        name = fruit_name(row.cells[fruit])
        if not name:
            raise BadInput(f"{row.place}: the fruit has no name.")
        for column, day in days.items():
            state = states.get(day.text)
            if not states or (state and row.cells[state]):
                cell = _cell(table, row, column, tag, name, day)
                sure = _said_cell(row, certainties.get(day.text))
                yield replace(cell, state=_said_cell(row, state), certainty=sure)


def _said(table: Table, prefix: str) -> dict[str, str]:
    """Columns of one kind beside the sizes, by what tells their visit."""
    names = (name for name in table.columns if name.startswith(prefix))
    return {name.removeprefix(prefix): name for name in names}


def _said_cell(row: TableRow, column: str | None) -> SaidCell | None:
    if column is None or not row.cells[column]:
        return None
    return SaidCell(row.cells[column], row.cell_place(column))


def _cell(
    table: Table, row: TableRow, column: str, cluster: int, fruit: str, day: WrittenDate
) -> CaliperCell:
    tree_row, tree = table.column(ROW), table.column(TREE)
    by_camera = row.cells.get(MEASURED_BY, "") == SizeSource.CAMERA
    return CaliperCell(
        row.cell_place(column),
        StandingTree(
            row.place,
            label_of(row.cells[tree_row]) if tree_row else "",
            label_of(row.cells[tree]) if tree else "",
        ),
        cluster,
        fruit,
        day,
        row.cells[column],
        SizeSource.CAMERA if by_camera else SizeSource.CALIPERS,
    )


def _dates(table: Table) -> list[str]:
    found = table.column(DATE)
    return [found] if found else []


def _day(table: Table, row: TableRow) -> WrittenDate:
    """From the column of dates, else from the name of the sheet."""
    column = table.column(DATE)
    if column is not None:
        return _written(table, row.cells[column], row.cell_place(column))
    if table.sheet.title is not None and is_day(table.sheet.title):
        return WrittenDate(table.sheet.title, table.name)
    raise _missing(table, DATE)


def _dated(table: Table, visits: Mapping[str, str]) -> dict[str, WrittenDate]:
    if number := next((name for visit, name in visits.items() if is_visit_number(visit)), None):
        raise BadInput(f"{table.name}: column {number} has a number, others have a date.")
    return {
        column: _written(table, visit, table.heading_place(column))
        for visit, column in visits.items()
    }


def _written(table: Table, text: str, place: str) -> WrittenDate:
    return WrittenDate(text, place, typed=text not in table.sheet.real_dates)


def _numbered(
    table: Table, visits: Mapping[str, str], dates: Sequence[date]
) -> dict[str, WrittenDate]:
    columns = [visits[number] for number in sorted(visits, key=int)]
    used = [column for column in columns if any(row.cells[column] for row in table.rows)]
    if not dates:
        raise BadInput(
            f"{table.name} numbers its visits ({', '.join(columns)}), but their dates are missing.",
            "Name them with --dates 2026-05-21,2026-05-25 and so on.",
        )
    if list(dates) != sorted(set(dates)):
        raise BadInput(f"The dates {', '.join(map(str, dates))} are not in order.")
    if len(dates) not in (len(used), len(columns)):
        raise BadInput(
            f"{table.name} has sizes of {number_of(len(used), 'visit')}, but --dates names"
            f" {len(dates)}."
        )
    named = columns if len(dates) == len(columns) else used
    return {
        column: WrittenDate(day.isoformat(), "--dates")
        for column, day in zip(named, dates, strict=True)
    }


def _needed(table: Table, names: Sequence[str]) -> str:
    found = table.column(names)
    if found is None:
        raise _missing(table, names)
    return found


def _missing(table: Table, names: Sequence[str]) -> BadInput:
    return BadInput(f"{table.name}: the column {names[0]} is missing.", SHAPES)
