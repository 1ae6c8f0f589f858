"""Data goes to standard output, everything else to standard error."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from shutil import get_terminal_size
from typing import Any

from fieldcam.errors import OutputLost

_NO_BREAK = "\N{NO-BREAK SPACE}"
JUSTIFIERS = {"<": str.ljust, ">": str.rjust}


def at_a_terminal() -> bool:
    """Whether screens can be drawn here."""
    drawable = os.environ.get("TERM", "") not in ("", "dumb", "unknown")
    return drawable and all(stream.isatty() for stream in (sys.stdin, sys.stdout, sys.stderr))


def screen_width() -> int | None:
    """Characters in a line of the terminal that the result goes to; None for a file or pipe."""
    return get_terminal_size().columns if sys.stdout.isatty() else None


def emit(text: str) -> None:
    """A line of the result."""
    with _output():
        sys.stdout.write(f"{_printable_lines(text)}\n")


def flush() -> None:
    """Hand over what was emitted; only then is it known to have arrived."""
    with _output():
        sys.stdout.flush()


@contextmanager
def _output() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputLost(f"The result could not be written: {error.strerror}.") from error


def emit_json(document: Mapping[str, Any]) -> None:
    """The result as one JSON document; NaN has no place in it."""
    emit(json.dumps(document, indent=2, allow_nan=False))


def narrate(text: str) -> None:
    """A line for the person who waits."""
    # The terminal may have been closed; then nobody waits.
    with suppress(OSError):
        sys.stderr.write(f"{_printable_lines(text)}\n")
        sys.stderr.flush()


def printable(text: str) -> str:
    """One line that a device or a file's name brought, without what commands the terminal."""
    return "".join(each if each.isprintable() or each == _NO_BREAK else "?" for each in text)


def _printable_lines(text: str) -> str:
    return "\n".join(map(printable, text.split("\n")))


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
