"""CSV tables, whichever of comma, semicolon and tab a spreadsheet put between cells."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from statistics import median

from fieldcam.errors import BadInput
from fieldcam.exchange.tables.sheets import Sheet, filled_rows, too_large
from fieldcam.exchange.tables.written import as_named
from fieldcam.foreign.bounds import MAX_TEXT_BYTES, MAX_TITLE_ROWS

_SEPARATORS = ";\t,|"
_SAID = re.compile(r"\"?sep=(.)\"?[;,\t]*", re.IGNORECASE)
"""A first line by which Excel is told what parts the cells."""
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def csv_sheet(name: str, data: bytes) -> Sheet:
    """Raises BadInput for what is no text, and for a line that is none of a table."""
    if len(data) > MAX_TEXT_BYTES:
        raise too_large(name, f"more than {MAX_TEXT_BYTES >> 20} MB of text")
    lines = _text(name, data).splitlines()
    said = _SAID.fullmatch(lines[0].strip()) if lines else None
    separator = said[1] if said else _separator(lines)
    rows = filled_rows(name, _rows(name, lines, separator, skipped=1 if said else 0))
    return Sheet(name, None, rows, separator=separator)


def _rows(
    name: str, lines: Sequence[str], separator: str, skipped: int
) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(lines[skipped:], delimiter=separator)
    try:
        for row in reader:
            yield reader.line_num + skipped, [as_named(cell) for cell in row]
    except csv.Error as error:
        line = reader.line_num + skipped
        raise BadInput(f"{name}, line {line}: it is no line of a table ({error}).") from error


def _separator(lines: Sequence[str]) -> str:
    """The one that most of the first lines have most of; a title has few of the right one."""
    first = [line for line in lines if line.strip()][:MAX_TITLE_ROWS]
    if not first:
        return ","
    return max(_SEPARATORS, key=lambda each: median(line.count(each) for line in first))


def _text(name: str, data: bytes) -> str:
    encoding = "UTF-16" if data.startswith(_UTF_16) else "UTF-8"
    try:
        return data.decode(encoding).removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        raise BadInput(f"{name} is no text in {encoding}.", "Save it as CSV (UTF-8).") from error
