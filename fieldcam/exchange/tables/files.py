"""A table's file: its content says of which kind it is, whatever its name ends in."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

from fieldcam.errors import BadInput
from fieldcam.exchange.tables.delimited import csv_sheet
from fieldcam.exchange.tables.markup import check_markup
from fieldcam.exchange.tables.opendocument import opendocument_sheets
from fieldcam.exchange.tables.sheets import Sheet, too_large
from fieldcam.exchange.tables.workbook import DAMAGED, workbook_sheets
from fieldcam.foreign.bounds import MAX_UNPACKED_BYTES, TABLE
from fieldcam.foreign.files import read_foreign
from fieldcam.words import spelled_out

_ZIP = b"PK\x03\x04"
_OLD_OFFICE = b"\xd0\xcf\x11\xe0"
"""How Excel 97 to 2003 files begin, and encrypted ones of today."""
_AS_WHAT = "Save it as .xlsx, .ods or CSV (UTF-8)."


def read_sheets(path: Path) -> list[Sheet]:
    """The sheets of a CSV table, an Excel workbook or an OpenDocument spreadsheet.

    Raises BadInput when the file cannot be read, is none of these, or is too large.
    """
    data, name = read_foreign(path, TABLE), spelled_out(path.name)
    if data.startswith(_ZIP):
        return _zipped(name, data)
    if data.startswith(_OLD_OFFICE):
        raise BadInput(
            f"{name} is a workbook of Excel 97 to 2003, or is locked by a password.", _AS_WHAT
        )
    return [csv_sheet(name, data)]


def _zipped(name: str, data: bytes) -> list[Sheet]:
    try:
        with ZipFile(BytesIO(data)) as archive:
            parts = archive.infolist()
            if sum(part.file_size for part in parts) > MAX_UNPACKED_BYTES:
                raise too_large(name, f"more than {MAX_UNPACKED_BYTES >> 20} MB")
            check_markup(name, archive)
    except DAMAGED as error:
        raise BadInput(f"{name} is no workbook that can be read.", _AS_WHAT) from error
    names = {part.filename for part in parts}
    if "content.xml" in names:
        return opendocument_sheets(name, data)
    if "[Content_Types].xml" in names:
        return workbook_sheets(name, data)
    raise BadInput(f"{name} is an archive, and holds no workbook.", _AS_WHAT)
