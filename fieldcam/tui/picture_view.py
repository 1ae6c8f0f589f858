"""The still picture: two pixels a cell, or one where the console has no half blocks."""

from __future__ import annotations

import os

import numpy as np
from rich.color import Color
from rich.color_triplet import ColorTriplet
from rich.segment import Segment
from rich.style import Style
from textual import work
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget
from textual.worker import get_current_worker

from fieldcam.errors import FieldcamError
from fieldcam.session.state import Shown
from fieldcam.tui.picture import still
from fieldcam.values import ImageU8

HALF = "▀"


class PictureView(Widget):
    """Shows the picture that is decided on, with its target's outlines."""

    class Drawn(Message):
        """A picture is ready, made in a thread."""

        def __init__(self, strips: list[Strip]) -> None:
            super().__init__()
            self.strips = strips

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self._halves = 1 if os.environ.get("TERM") == "linux" else 2
        self._shown: Shown | None = None
        self._strips: list[Strip] = []

    def show(self, shown: Shown | None) -> None:
        self._shown = shown
        self._redraw()

    def on_resize(self) -> None:
        self._redraw()

    def on_picture_view_drawn(self, message: Drawn) -> None:
        self._strips = message.strips
        self.refresh()

    def render_line(self, y: int) -> Strip:
        if y < len(self._strips):
            return self._strips[y]
        return Strip.blank(self.size.width, self.rich_style)

    def _redraw(self) -> None:
        width, height = self.size
        if self._shown is None or not width or not height:
            self.workers.cancel_node(self)
            self._strips = []
            self.refresh()
            return
        self._draw(self._shown, (width, height * self._halves))

    @work(thread=True, exclusive=True, group="picture", exit_on_error=False)
    def _draw(self, shown: Shown, size: tuple[int, int]) -> None:
        try:
            small = still(shown, size)
        except (FieldcamError, OSError):
            # The numbers stay on the screen; the start-up check names missing files.
            strips: list[Strip] = []
        else:
            strips = half_blocks(small) if self._halves == 2 else full_cells(small)
        if not get_current_worker().is_cancelled:
            self.post_message(self.Drawn(strips))


def half_blocks(small: ImageU8) -> list[Strip]:
    """Two rows of pixels in one row of cells."""
    return [_strip(top, bottom, HALF) for top, bottom in zip(small[::2], small[1::2], strict=True)]


def full_cells(small: ImageU8) -> list[Strip]:
    """One pixel a cell, as a background: needs no glyph."""
    return [_strip(row, row, " ") for row in small]


def _strip(top: ImageU8, bottom: ImageU8, glyph: str) -> Strip:
    pairs = np.concatenate([top, bottom], axis=1).tolist()
    cells = [Segment(glyph, Style(color=_rgb(p[:3]), bgcolor=_rgb(p[3:]))) for p in pairs]
    return Strip(cells, len(cells))


def _rgb(values: list[int]) -> Color:
    return Color.from_triplet(ColorTriplet(*values))
