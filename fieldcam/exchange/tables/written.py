"""CSV tables that leave: no name in them is a formula for a spreadsheet program."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence

_FORMULA = re.compile(r"'*[=+\-@\t\r\N{FULLWIDTH EQUALS SIGN}\N{FULLWIDTH PLUS SIGN}]")
_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d+)?")
_AS_TEXT = "'"
"""Spreadsheet programs take what follows for text."""


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Comma-separated lines; cells that would be formulas get an apostrophe before them."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(
        [as_text(cell) if isinstance(cell, str) else cell for cell in row] for row in rows
    )
    return out.getvalue()


def as_text(cell: str) -> str:
    """The cell as one that no spreadsheet program computes."""
    computed = _FORMULA.match(cell) and not _NUMBER.fullmatch(cell)
    return f"{_AS_TEXT}{cell}" if computed else cell


def as_named(cell: str) -> str:
    """What `as_text` was given."""
    return cell[1:] if cell.startswith(_AS_TEXT) and _FORMULA.match(cell) else cell
