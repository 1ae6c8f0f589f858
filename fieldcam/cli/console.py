"""Data goes to standard output, everything else to standard error."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

JUSTIFIERS = {"<": str.ljust, ">": str.rjust}


def emit(text: str) -> None:
    """A line of the result."""
    sys.stdout.write(f"{text}\n")


def emit_json(document: Mapping[str, Any]) -> None:
    """The result as one JSON document; NaN has no place in it."""
    emit(json.dumps(document, indent=2, allow_nan=False))


def narrate(text: str) -> None:
    """A line for the person who waits."""
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


def table(rows: Sequence[Sequence[str]], alignment: str) -> list[str]:
    """Lines of a table; `alignment` holds one of < and > for each column."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(alignment))]
    return [
        "  ".join(
            JUSTIFIERS[side](cell, width)
            for cell, side, width in zip(row, alignment, widths, strict=True)
        ).rstrip()
        for row in rows
    ]
