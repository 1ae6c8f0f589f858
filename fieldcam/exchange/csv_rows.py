"""Rows of a CSV table, whichever of comma, semicolon and tab a spreadsheet put between cells."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from fieldcam.errors import BadInput

_ZIP = b"PK\x03\x04"
"""How a workbook begins."""
_SEPARATORS = ";\t,"


def read_rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Rows that are not empty, each with the number of its line, counted from 1.

    Raises BadInput when the file cannot be read, or is no table.
    """
    text = _text(path)
    heading = next((line for line in text.splitlines() if line.strip()), "")
    separator = max(_SEPARATORS, key=heading.count)
    reader = csv.reader(text.splitlines(), delimiter=separator)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield reader.line_num, cells
    except csv.Error as error:
        raise BadInput(
            f"{path.name}, line {reader.line_num}: it is no line of a table ({error})."
        ) from error


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise BadInput(f"There is no file {path}.") from error
    except OSError as error:
        raise BadInput(f"{path} cannot be read: {error.strerror}.") from error
    if data.startswith(_ZIP):
        raise BadInput(f"{path.name} is a workbook, not a CSV table.", "Let its name end in .xlsx.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput(f"{path.name} is no text in UTF-8.", "Save it as CSV (UTF-8).") from error
