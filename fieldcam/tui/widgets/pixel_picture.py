"""The still picture in pixels, drawn by textual-image; needs the extra `pictures`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PIL import Image
from textual.app import ComposeResult
from textual.widgets import Static
from textual_image.widget import SixelImage, TGPImage

from fieldcam.tui.looks import PictureStyle
from fieldcam.tui.widgets.picture_view import PictureView
from fieldcam.tui.widgets.sketch import Painted, stamped

LABEL_SCALE = 2
"""Pixels a dot: a digit is about as high as a cell."""


class PixelPicture(PictureView):
    """The library scales the picture to the cells that it is given."""

    CELL_PX = (8, 16)
    """As many as most terminals have or fewer, so that no time goes into pixels unseen."""

    def __init__(self, pictures: PictureStyle) -> None:
        super().__init__()
        self._image = SixelImage() if pictures is PictureStyle.SIXEL else TGPImage()

    def compose(self) -> ComposeResult:
        yield Static(id="words", markup=False)
        yield self._image

    def painting(self, seen: Painted | str) -> Callable[[], None]:
        if isinstance(seen, str):
            return partial(self._put, None, seen)
        return partial(self._put, Image.fromarray(stamped(seen, LABEL_SCALE)), "")

    def _put(self, image: Image.Image | None, words: str) -> None:
        told = self.query_one("#words", Static)
        told.display = bool(words)
        told.update(words)
        self._image.image = image
