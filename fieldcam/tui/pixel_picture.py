"""The still picture in pixels, drawn by textual-image; needs the extra `pictures`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PIL import Image
from textual.app import ComposeResult
from textual_image.widget import SixelImage, TGPImage

from fieldcam.tui.looks import Pictures
from fieldcam.tui.picture_view import PictureView
from fieldcam.values import ImageU8


class PixelPicture(PictureView):
    """The library scales the picture to the cells that it is given."""

    CELL_PX = (8, 16)
    """As many as most terminals have or fewer, so that no time goes into pixels unseen."""

    def __init__(self, pictures: Pictures) -> None:
        super().__init__()
        self._image = SixelImage() if pictures is Pictures.SIXEL else TGPImage()

    def compose(self) -> ComposeResult:
        yield self._image

    def painting(self, small: ImageU8 | None) -> Callable[[], None]:
        return partial(self._put, None if small is None else Image.fromarray(small))

    def _put(self, image: Image.Image | None) -> None:
        self._image.image = image
