"""The black runs of a pattern made of cells, which is printed as rectangles."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from fieldcam.values import ImageU8


def runs_of(cells: ImageU8) -> Iterator[tuple[int, int, int]]:
    """Row from above, first column from the left, and length of each run of 0 in (H, W)."""
    for row, values in enumerate(cells):
        column = 0
        for light, run in groupby(bool(value) for value in values):
            length = len(list(run))
            if not light:
                yield row, column, length
            column += length
