"""The tables that caliper sizes come in: CSV files, and the authors' workbook."""

from __future__ import annotations

import re
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import ParseError

from fieldcam.errors import BadInput
from fieldcam.exchange.caliper_cells import is_day
from fieldcam.exchange.csv_rows import read_rows

if TYPE_CHECKING:
    from openpyxl.cell import Cell
    from openpyxl.worksheet.worksheet import Worksheet

WORKBOOKS = (".xlsx", ".xlsm")
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    ParseError,
    EOFError,
    NotImplementedError,
    AttributeError,
    LookupError,
    TypeError,
    ValueError,
)
"""What openpyxl, and the modules that it reads with, raise for a damaged workbook."""


@dataclass(frozen=True, slots=True)
class TableRow:
    """One row below the heading."""

    place: str
    """Of the row, for complaints about it."""
    cells: dict[str, str]
    """By column, stripped."""
    cell_places: dict[str, str]
    """Of each cell."""


@dataclass(frozen=True, slots=True)
class Table:
    """A heading and the rows below it."""

    name: str
    """Of the file, or of the file and the sheet."""
    sheet: str
    """Empty for a CSV file."""
    columns: tuple[str, ...]
    """Lower case."""
    rows: tuple[TableRow, ...]


def csv_table(path: Path) -> Table:
    """Raises BadInput for a file without a heading, or a row that is longer than it."""
    lines = read_rows(path)
    number, heading = next(lines, (1, []))
    if not heading:
        raise BadInput(f"{path.name} is empty.")
    columns = _columns(heading, f"{path.name}, line {number}")
    rows = []
    for line, cells in lines:
        place = f"{path.name}, line {line}"
        _check_length(cells, columns, place)
        places = {column: f"{place}, column {column}" for column in columns}
        rows.append(TableRow(place, _by_column(columns, cells), places))
    return Table(path.name, "", columns, tuple(rows))


def workbook_tables(path: Path) -> tuple[list[Table], list[str]]:
    """The sheets that are named as a date, and the names of the others."""
    from openpyxl import load_workbook
    from openpyxl.utils.exceptions import InvalidFileException

    try:
        # Formulas twice: as they are written, and what they came to when last computed.
        with (
            closing(load_workbook(path, data_only=True)) as values,
            closing(load_workbook(path)) as written,
        ):
            dated = [sheet for sheet in values.worksheets if is_day(sheet.title.strip())]
            others = [sheet.title for sheet in values.worksheets if sheet not in dated]
            return [_sheet_table(path, sheet, written[sheet.title]) for sheet in dated], others
    except FileNotFoundError as error:
        raise BadInput(f"There is no file {path}.") from error
    except OSError as error:
        raise BadInput(f"{path} cannot be read: {error.strerror}.") from error
    except (InvalidFileException, *_DAMAGED) as error:
        raise BadInput(f"{path.name} is no workbook that can be read.") from error


def _sheet_table(path: Path, values: Worksheet, written: Worksheet) -> Table:
    name = f"{path.name}, sheet {values.title}"
    filled = _filled_rows(name, values, written)
    number, heading = next(filled, (1, []))
    columns = _columns(heading, f"{name}, row {number}")
    rows = []
    for line, cells in filled:
        place = f"{name}, row {line}"
        _check_length(cells, columns, place)
        places = {c: f"{name}, cell {_letters(i)}{line}" for i, c in enumerate(columns)}
        rows.append(TableRow(place, _by_column(columns, cells), places))
    return Table(name, values.title.strip(), columns, tuple(rows))


def _filled_rows(
    name: str, values: Worksheet, written: Worksheet
) -> Iterator[tuple[int, list[str]]]:
    for row, formulas in zip(values.iter_rows(), written.iter_rows(), strict=True):
        cells = [_text(value, formula, name) for value, formula in zip(row, formulas, strict=True)]
        if any(cells):
            yield row[0].row, cells


def _text(value: Cell, formula: Cell, name: str) -> str:
    if value.value is None and formula.value is not None:
        raise BadInput(
            f"{name}, cell {value.coordinate}: its formula was never computed.",
            "Open the workbook in a spreadsheet program and save it.",
        )
    if isinstance(value.value, datetime):
        return value.value.date().isoformat()
    return "" if value.value is None else str(value.value).strip()


def _columns(heading: Sequence[str], place: str) -> tuple[str, ...]:
    names = [re.sub(r"\s+", "_", cell.lower()) for cell in heading]
    while names and not names[-1]:
        names.pop()
    twice = next((name for name in names if name and names.count(name) > 1), None)
    if twice is not None:
        raise BadInput(f"{place}: there are two columns {twice}.")
    return tuple(names)


def _check_length(cells: Sequence[str], columns: Sequence[str], place: str) -> None:
    filled = len(cells) - next((i for i, cell in enumerate(reversed(cells)) if cell), 0)
    if filled > len(columns):
        raise BadInput(
            f"{place}: there are {filled} cells below {len(columns)} headings; are commas"
            " used both as decimals and between the cells?",
            "Save the table with semicolons between the cells, or with points as decimals.",
        )


def _by_column(columns: Sequence[str], cells: Sequence[str]) -> dict[str, str]:
    padded = [*cells, *[""] * (len(columns) - len(cells))]
    return {name: cell for name, cell in zip(columns, padded, strict=False) if name}


def _letters(column: int) -> str:
    """A for 0, Z for 25, AA for 26."""
    more, last = divmod(column, 26)
    return (_letters(more - 1) if more else "") + chr(ord("A") + last)
