"""Sheets of an OpenDocument spreadsheet, as LibreOffice saves them (ODF 1.2, part 1, chapter 9)."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import IO, TYPE_CHECKING
from zipfile import ZipFile

from fieldcam.errors import BadInput
from fieldcam.exchange.tables.sheets import Sheet, filled_rows, too_large
from fieldcam.exchange.tables.workbook import DAMAGED
from fieldcam.foreign.bounds import MAX_CELLS, MAX_ROWS, MAX_SHEETS

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
_OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"
_TEXT = "{urn:oasis:names:tc:opendocument:xmlns:text:1.0}"
_CELLS = (f"{_TABLE}table-cell", f"{_TABLE}covered-table-cell")


def opendocument_sheets(name: str, data: bytes) -> list[Sheet]:
    """All sheets; raises BadInput for what cannot be read."""
    try:
        with ZipFile(BytesIO(data)) as archive, archive.open("content.xml") as content:
            return list(_sheets(name, content))
    except DAMAGED as error:
        raise BadInput(f"{name} is no spreadsheet that can be read.") from error


def _sheets(name: str, content: IO[bytes]) -> Iterator[Sheet]:
    from defusedxml.ElementTree import iterparse

    read: list[_Rows] = []
    for event, element in iterparse(content, ("start", "end"), forbid_dtd=True):
        if event == "start" and element.tag == f"{_TABLE}table":
            if len(read) == MAX_SHEETS:
                raise too_large(name, f"more than {MAX_SHEETS} sheets")
            read.append(_Rows(name, element.get(f"{_TABLE}name", "").strip()))
        elif event == "end" and element.tag == f"{_TABLE}table-row" and read:
            read[-1].add(element)
            # Else the whole document would be held at once.
            element.clear()
    return (rows.sheet() for rows in read)


class _Rows:
    """The rows of one sheet, as they come."""

    def __init__(self, file: str, title: str) -> None:
        self.file, self.title = file, title
        self.name = f"{file}, sheet {title}"
        self.dates: set[str] = set()
        self._rows: list[tuple[int, list[str]]] = []
        self._number = 0
        self._cells = 0

    def add(self, row: Element) -> None:
        """Once for each time that it is repeated, unless it is empty."""
        texts, times = self._texts(row), _times(row, "rows")
        self._count(len(texts) * times)
        if texts and len(self._rows) + times > MAX_ROWS:
            raise too_large(self.name, f"more than {MAX_ROWS:,} rows")
        if texts:
            self._rows += [(self._number + k, texts) for k in range(1, times + 1)]
        self._number += times

    def sheet(self) -> Sheet:
        rows = filled_rows(self.name, self._rows)
        return Sheet(self.file, self.title, rows, frozenset(self.dates))

    def _texts(self, row: Element) -> list[str]:
        """Up to the last filled cell."""
        texts: list[str] = []
        empty = 0
        for cell in (each for each in row if each.tag in _CELLS):
            text, times = _text(cell, self.dates), _times(cell, "columns")
            if text:
                self._count(len(texts) + empty + times)
                texts += [""] * empty + [text] * times
            empty = 0 if text else empty + times
        return texts

    def _count(self, more: int) -> None:
        self._cells += more
        if self._cells > MAX_CELLS:
            raise too_large(self.name, f"more than {MAX_CELLS:,} cells")


def _text(cell: Element, dates: set[str]) -> str:
    """What the cell is, not how it is shown; a date is written as in ISO 8601."""
    kind = cell.get(f"{_OFFICE}value-type", "")
    if kind == "date" and (day := cell.get(f"{_OFFICE}date-value", "").partition("T")[0]):
        dates.add(day)
        return day
    if kind == "float" and (value := cell.get(f"{_OFFICE}value")):
        return value
    return " ".join("".join(each.itertext()) for each in cell.findall(f"{_TEXT}p")).strip()


def _times(element: Element, what: str) -> int:
    """How often a cell or row stands there; raises ValueError for what is no number."""
    return max(1, int(element.get(f"{_TABLE}number-{what}-repeated", "1")))
