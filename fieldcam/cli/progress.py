"""How far a long command is, on standard error."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import TypeVar

from fieldcam.cli.console import narrate

WIDTH = 30
STEPS = 10
"""How many lines there are where a bar cannot be drawn over and over."""
Item = TypeVar("Item")


def progress(items: Iterable[Item], total: int) -> Iterator[Item]:
    """The same items; how many of them are done is shown as they go by."""
    bar = sys.stderr.isatty()
    try:
        if bar:
            _draw(_picture(0, total))
        for done, item in enumerate(items, 1):
            if bar:
                _draw(_picture(done, total))
            elif done * STEPS // total > (done - 1) * STEPS // total:
                narrate(f"{done} of {total}")
            yield item
    finally:
        if bar:
            _draw("")


def _picture(done: int, total: int) -> str:
    full = WIDTH * done // total
    return f"[{'#' * full}{'.' * (WIDTH - full)}] {done} of {total}"


def _draw(text: str) -> None:
    """Over what this line held before."""
    sys.stderr.write(f"\r{text}\x1b[K")
    sys.stderr.flush()
