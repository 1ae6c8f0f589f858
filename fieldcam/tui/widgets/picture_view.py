"""The still picture: drawn in a thread, whatever it is painted with."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from textual import work
from textual.events import Click
from textual.message import Message
from textual.widget import Widget
from textual.worker import get_current_worker

from fieldcam.errors import ImageUnreadable
from fieldcam.growth.places import Place
from fieldcam.session.state import Shown
from fieldcam.tui.widgets.picture import not_there
from fieldcam.tui.widgets.sketch import Painted, Sketch, Still


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


class NoPicture(PictureView):
    """Numbers only: takes no room and draws nothing."""

    def on_mount(self) -> None:
        self.display = False

    def draw(self, sketch: Sketch | None) -> None:
        """Nothing."""
