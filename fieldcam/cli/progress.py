"""How far a long command is, on standard error."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import TypeVar

from fieldcam.cli.console import narrate
from fieldcam.words import number_of

WIDTH = 30
STEPS = 10
"""How many lines there are where a bar cannot be drawn over and over."""
Item = TypeVar("Item")


def progress(items: Iterable[Item], total: int, noun: str) -> Iterator[Item]:
    """The same items; how many of them are done is shown as they go by.

    `noun` says what one of them is, such as "cluster".
    """
    bar = sys.stderr.isatty()
    try:
        if bar:
            _draw(_picture(0, total, noun))
        for done, item in enumerate(items, 1):
            if bar:
                _draw(_picture(done, total, noun))
            elif done * STEPS // total > (done - 1) * STEPS // total:
                narrate(f"{done} of {number_of(total, noun)}")
            yield item
    finally:
        if bar:
            _draw("")


def _picture(done: int, total: int, noun: str) -> str:
    full = WIDTH * done // total
    return f"[{'#' * full}{'.' * (WIDTH - full)}] {done} of {number_of(total, noun)}"


def _draw(text: str) -> None:
    """Over what this line held before."""
    sys.stderr.write(f"\r{text}\x1b[K")
    sys.stderr.flush()
