"""Sizes by day as bars of text: a row for each millimetre, a column for each day."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from datetime import date

from fieldcam.tui.text.letters import BLOCK

STEPS_MM = (1, 2, 5, 10)
LABEL = 7
"""Columns of a row's name."""
MIN_COLUMN = 12


def histogram(days: Sequence[tuple[date, Sequence[float]]], columns: int, rows: int) -> list[str]:
    """At most this many columns and rows, headings included; the last days where not all fit."""
    fitting = max(1, (columns - LABEL) // MIN_COLUMN)
    shown = [(day, sizes) for day, sizes in days if sizes][-fitting:]
    if not shown:
        return ["No accepted sizes yet."]
    low = math.floor(min(min(sizes) for _, sizes in shown))
    high = max(max(sizes) for _, sizes in shown)
    # The coarsest step is taken where none fits; the screen cuts the rest off.
    step = next((s for s in STEPS_MM if (high - low) // s + 2 <= rows), STEPS_MM[-1])
    low = low // step * step
    bins = range(low, math.floor(high) + 1, step)
    counts = [Counter(low + int((size - low) // step) * step for size in s) for _, s in shown]
    width = (columns - LABEL) // len(shown)
    most = max(max(count.values()) for count in counts)
    heading = "mm".rjust(LABEL - 1) + " " + "".join(f"{day:%d %b}".ljust(width) for day, _ in shown)
    lines = [heading.rstrip()]
    for start in bins:
        name = f"{start}" if step == 1 else f"{start}-{start + step}"
        cells = (_bar(count[start], most, width) for count in counts)
        lines.append((name.rjust(LABEL - 1) + " " + "".join(cells)).rstrip())
    return lines


def _bar(count: int, most: int, width: int) -> str:
    """The bar and its number; nothing where there is none."""
    if not count:
        return " " * width
    longest = width - len(f" {most} ") - 1
    return f"{BLOCK * max(1, round(count / most * longest))} {count}".ljust(width)
