"""Two pictures side by side with a line from each fruitlet to itself on the other day."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fieldcam.growth.places import Place
from fieldcam.session.state import Shown
from fieldcam.tui.screens.pairs import Pair, PairRow
from fieldcam.tui.widgets.picture import (
    ASKED,
    CHOSEN,
    OUTLINE,
    Colour,
    Cutout,
    draw_line,
    frame_around,
    still,
)
from fieldcam.tui.widgets.sketch import Label, Painted, Size, letter_in, nearest, targets
from fieldcam.values import Fruitlet, ImageU8

GAP = 40
"""The room between the pictures is one such part of the width."""
DASH = 0.02
"""Of a doubtful line, as a share of the width."""


@dataclass(frozen=True, slots=True, eq=False)
class TwoStills:
    """The earlier picture on the left; the chosen row stands out."""

    pair: Pair
    rows: tuple[PairRow, ...]
    chosen: int
    alone: tuple[tuple[Fruitlet, ...], ...] = ((), ())
    """Each picture's fruitlets without depth, which have a letter and no number."""

    @property
    def key(self) -> object:
        return [(shown.left, shown.record.reading) for shown in self.pair], self.rows, self.chosen

    def paint(self, size: Size) -> Painted:
        half, second = _halves(size)
        row = next((row for row in self.rows if row.number == self.chosen), None)
        image = np.zeros((size[1], size[0], 3), np.uint8)
        for shown, place, x0 in zip(
            self.pair,
            (None, None) if row is None else (row.one, row.other),
            (0, second),
            strict=True,
        ):
            chosen = None if place is None else place.fruitlet
            image[:, x0 : x0 + half[0]] = still(shown, half, chosen, _frame(shown, half))
        ends = [_ends(row, self.pair, half, second) for row in self.rows]
        for row, (start, end) in zip(self.rows, ends, strict=True):
            self._join(image, row, start, end)
        labels = [
            Label(*end, letter_in(shown, place.fruitlet), self._colour(row))
            for row, places in zip(self.rows, ends, strict=True)
            for shown, place, end in zip(self.pair, (row.one, row.other), places, strict=True)
            if place is not None and end is not None
        ]
        return Painted(image, (*labels, *self._letters(half, second)))

    def _letters(self, half: Size, second: int) -> Iterator[Label]:
        for shown, fruitlets, x0 in zip(self.pair, self.alone, (0, second), strict=True):
            frame = _frame(shown, half)
            if frame is None:
                continue
            for fruitlet in fruitlets:
                x, y = frame.place(fruitlet.center_px)
                yield Label(x0 + x, y, f"{letter_in(shown, fruitlet.id)}?", ASKED)

    def at(self, x: float, y: float, size: Size) -> Place | None:
        half, second = _halves(size)
        shown, x0 = (self.pair[0], 0) if x < half[0] else (self.pair[1], second)
        frame = _frame(shown, half)
        return None if frame is None else nearest(shown, frame, x - x0, y)

    def _join(
        self,
        image: ImageU8,
        row: PairRow,
        start: tuple[float, float] | None,
        end: tuple[float, float] | None,
    ) -> None:
        if start is not None and end is not None:
            dash = max(1, round(DASH * image.shape[1])) if row.doubtful else None
            draw_line(image, start, end, self._colour(row), dash)

    def _colour(self, row: PairRow) -> Colour:
        if row.number == self.chosen:
            return CHOSEN
        return ASKED if row.doubtful else OUTLINE


def _halves(size: Size) -> tuple[Size, int]:
    """The size of each picture, and where the second one begins."""
    half = max(1, (size[0] - max(2, size[0] // GAP)) // 2)
    return (half, size[1]), size[0] - half


def _frame(shown: Shown, half: Size) -> Cutout | None:
    """Nearer than with the tag; None where there is no target."""
    boxes = [fruitlet.box_px for fruitlet in targets(shown)]
    return frame_around(boxes, half) if boxes else None


def _ends(
    row: PairRow, pair: Pair, half: Size, second: int
) -> tuple[tuple[float, float] | None, tuple[float, float] | None]:
    """Where a fruitlet is in the two pictures, in small pixels."""
    return _place(pair[0], row.one, half, 0), _place(pair[1], row.other, half, second)


def _place(shown: Shown, place: Place | None, half: Size, x0: int) -> tuple[float, float] | None:
    fruitlets = {fruitlet.id: fruitlet for fruitlet in targets(shown)}
    frame = _frame(shown, half)
    if frame is None or place is None or place.fruitlet not in fruitlets:
        return None
    x, y = frame.place(fruitlets[place.fruitlet].center_px)
    return x0 + x, y
