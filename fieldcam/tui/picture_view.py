"""The still picture, made of whatever the terminal can show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from textwrap import wrap
from typing import ClassVar

import numpy as np
from rich.color import Color, ColorType
from rich.color_triplet import ColorTriplet
from rich.segment import Segment
from rich.style import Style
from textual import work
from textual.events import Click
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget
from textual.worker import get_current_worker

from fieldcam.errors import ImageUnreadable
from fieldcam.growth.places import Place
from fieldcam.session.state import Shown
from fieldcam.tui.looks import PIXELS, Pictures
from fieldcam.tui.widgets.picture import not_there
from fieldcam.tui.widgets.sketch import Label, Painted, Sketch, Still
from fieldcam.values import ImageU8

HALF = "▀"


class PictureView(Widget):
    """Shows one picture with its target's outlines; each kind paints it in its own way."""

    CELL_PX: ClassVar[tuple[int, int]] = (1, 2)
    """Columns and rows of pixels in a cell."""

    class Drawn(Message):
        """A picture is ready, made in a thread."""

        def __init__(self, put: Callable[[], None]) -> None:
            super().__init__()
            self.put = put

    class Picked(Message):
        """A fruitlet was clicked on."""

        def __init__(self, place: Place) -> None:
            super().__init__()
            self.place = place

    def __init__(self) -> None:
        super().__init__(id="picture")
        self._sketch: Sketch | None = None

    def show(self, shown: Shown | None, chosen: int | None = None) -> None:
        """One picture, with a fruitlet that stands out."""
        self.draw(None if shown is None else Still(shown, chosen))

    def draw(self, sketch: Sketch | None) -> None:
        before, self._sketch = self._sketch, sketch
        if (sketch and sketch.key) != (before and before.key):
            self._redraw()

    def on_resize(self) -> None:
        self._redraw()

    def on_click(self, event: Click) -> None:
        """Also one on the widget that draws the pixels."""
        columns, rows = self.CELL_PX
        x = (event.screen_x - self.content_region.x + 0.5) * columns
        y = (event.screen_y - self.content_region.y + 0.5) * rows
        if self._sketch is not None and (place := self._sketch.at(x, y, self._size_px)):
            self.post_message(self.Picked(place))

    def on_picture_view_drawn(self, message: Drawn) -> None:
        message.put()

    def painting(self, seen: Painted | str) -> Callable[[], None]:
        """Makes in a thread what is then put on the screen: a picture, or words in its place."""
        return lambda: None

    @property
    def _size_px(self) -> tuple[int, int]:
        (width, height), (columns, rows) = self.size, self.CELL_PX
        return width * columns, height * rows

    def _redraw(self) -> None:
        if self._sketch is None or not all(self._size_px):
            self.workers.cancel_node(self)
            self.painting("")()
            return
        self._draw(self._sketch, self._size_px)

    # Without a description Textual would write out the whole reading, arrays and all.
    @work(thread=True, exclusive=True, group="picture", exit_on_error=False, description="still")
    def _draw(self, sketch: Sketch, size: tuple[int, int]) -> None:
        seen: Painted | str
        try:
            seen = sketch.paint(size)
        except (OSError, ImageUnreadable) as error:
            seen = not_there(error)
        put = self.painting(seen)
        if not get_current_worker().is_cancelled:
            self.post_message(self.Drawn(put))


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


class NoPicture(PictureView):
    """Numbers only: takes no room and draws nothing."""

    def on_mount(self) -> None:
        self.display = False

    def draw(self, sketch: Sketch | None) -> None:
        """Nothing."""


def picture_view(pictures: Pictures) -> PictureView:
    """The view for this terminal."""
    if pictures in PIXELS:
        # Needs the extra, and asks the terminal when it is imported.
        from fieldcam.tui.widgets.pixel_picture import PixelPicture

        return PixelPicture(pictures)
    kinds = {Pictures.CELLS: CellPicture, Pictures.NONE: NoPicture}
    return kinds.get(pictures, BlockPicture)()


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
