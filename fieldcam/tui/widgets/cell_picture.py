"""The still picture in cells of the terminal: half blocks, or a background alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from textwrap import wrap

import numpy as np
from rich.color import Color, ColorType
from rich.color_triplet import ColorTriplet
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from fieldcam.tui.widgets.picture_view import PictureView
from fieldcam.tui.widgets.sketch import Label, Painted
from fieldcam.values import ImageU8

HALF = "▀"


class BlockPicture(PictureView):
    """Half blocks: two pixels a cell."""

    def __init__(self) -> None:
        super().__init__()
        self._strips: list[Strip] = []
        self._words: list[str] = []

    def painting(self, seen: Painted | str) -> Callable[[], None]:
        if isinstance(seen, str):
            return partial(self._say, seen)
        return partial(self._put, labelled(self.strips(seen.image), seen.labels, self.CELL_PX))

    def strips(self, small: ImageU8) -> list[Strip]:
        return half_blocks(small)

    def render_line(self, y: int) -> Strip:
        if y < len(self._strips):
            return self._strips[y]
        if y < len(self._words):
            # In the theme's colours of now.
            width = self.size.width
            return Strip([Segment(self._words[y].ljust(width), self.rich_style)], width)
        return Strip.blank(self.size.width, self.rich_style)

    def _say(self, words: str) -> None:
        self._words = wrap(words, max(1, self.size.width))
        self._put([])

    def _put(self, strips: list[Strip]) -> None:
        self._strips = strips
        self.refresh()


class CellPicture(BlockPicture):
    """A background colour for each cell, where the console's font has no half blocks."""

    CELL_PX = (1, 1)

    def strips(self, small: ImageU8) -> list[Strip]:
        return full_cells(small)


def half_blocks(small: ImageU8) -> list[Strip]:
    """Two rows of pixels in one row of cells."""
    return [_strip(top, bottom, HALF) for top, bottom in zip(small[::2], small[1::2], strict=True)]


def full_cells(small: ImageU8) -> list[Strip]:
    """One pixel a cell, as a background: needs no glyph."""
    return [_strip(row, row, " ") for row in small]


def labelled(strips: list[Strip], labels: Sequence[Label], cell_px: tuple[int, int]) -> list[Strip]:
    """Numbers in place of cells; they stay inside the picture."""
    cells = [list(strip) for strip in strips]
    for label in labels:
        row = min(max(0, int(label.y / cell_px[1])), len(cells) - 1)
        first = int(label.x / cell_px[0] - (len(label.text) - 1) / 2)
        first = min(max(0, first), len(cells[row]) - len(label.text))
        style = Style.from_color(_rgb([0, 0, 0]), _rgb([*label.ground])) + Style(bold=True)
        for place, letter in enumerate(label.text, first):
            cells[row][place] = Segment(letter, style)
    return [Strip(line, len(line)) for line in cells]


def _strip(top: ImageU8, bottom: ImageU8, glyph: str) -> Strip:
    pairs = np.concatenate([top, bottom], axis=1).tolist()
    cells = [Segment(glyph, Style.from_color(_rgb(p[:3]), _rgb(p[3:]))) for p in pairs]
    return Strip(cells, len(cells))


def _rgb(values: list[int]) -> Color:
    # `Color.from_triplet` spells out each colour's name, which takes twice as long as all else.
    return Color("", ColorType.TRUECOLOR, triplet=ColorTriplet(*values))
