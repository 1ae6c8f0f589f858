"""Sheets of an Excel workbook."""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Iterator
from contextlib import closing
from datetime import datetime
from io import BytesIO
from typing import TYPE_CHECKING
from xml.etree.ElementTree import ParseError
from zipfile import BadZipFile

from fieldcam.errors import BadInput
from fieldcam.exchange.tables.sheets import Sheet, column_letters, filled_rows, too_large
from fieldcam.foreign.bounds import LAST_ROW, MAX_CELLS, MAX_SHEETS

if TYPE_CHECKING:
    from openpyxl.worksheet._read_only import ReadOnlyWorksheet

DAMAGED = (
    BadZipFile,
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


def workbook_sheets(name: str, data: bytes) -> list[Sheet]:
    """All sheets with cells; raises BadInput for what cannot be read."""
    from openpyxl.utils.exceptions import InvalidFileException

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _sheets(name, data)
    except (InvalidFileException, *DAMAGED) as error:
        raise BadInput(f"{name} is no workbook that can be read.") from error


def _sheets(name: str, data: bytes) -> list[Sheet]:
    from openpyxl import load_workbook

    # Formulas twice: as they are written, and what they came to when last computed.
    with (
        closing(load_workbook(BytesIO(data), read_only=True, data_only=True)) as values,
        closing(load_workbook(BytesIO(data), read_only=True)) as written,
    ):
        if len(values.worksheets) > MAX_SHEETS:
            raise too_large(name, f"more than {MAX_SHEETS} sheets")
        both = zip(values.worksheets, written.worksheets, strict=True)
        return [_sheet(name, sheet, formulas) for sheet, formulas in both]


def _sheet(file: str, values: ReadOnlyWorksheet, written: ReadOnlyWorksheet) -> Sheet:
    title = values.title.strip()
    name = f"{file}, sheet {title}"
    dates: set[str] = set()
    both = zip(_rows(name, values), _rows(name, written), strict=True)
    rows = filled_rows(
        name, ((n, _texts(name, n, row, said, dates)) for (n, row), (_, said) in both)
    )
    return Sheet(file, title, rows, frozenset(dates))


def _rows(name: str, sheet: ReadOnlyWorksheet) -> Iterator[tuple[int, tuple[object, ...]]]:
    """With their numbers; those without any cell are left out."""
    # What a sheet says of its size is often wrong, and each row would be filled up to it.
    sheet.reset_dimensions()
    cells = 0
    for number, row in enumerate(sheet.values, start=1):
        cells += len(row)
        if cells > MAX_CELLS or number > LAST_ROW:
            raise too_large(name, f"more than {MAX_CELLS:,} cells")
        if row:
            yield number, row


def _texts(
    name: str, number: int, values: tuple[object, ...], written: tuple[object, ...], dates: set[str]
) -> Iterator[str]:
    for index, (value, formula) in enumerate(zip(values, written, strict=True)):
        if value is None and formula is not None:
            raise BadInput(
                f"{name}, cell {column_letters(index)}{number}: its formula was never computed.",
                "Open the workbook in a spreadsheet program and save it.",
            )
        if isinstance(value, datetime):
            dates.add(value.date().isoformat())
            yield value.date().isoformat()
        else:
            yield "" if value is None else str(value)
