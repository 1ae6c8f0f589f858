"""The still picture, made of what the terminal can show."""

from __future__ import annotations

from fieldcam.tui.looks import PIXELS, PictureStyle
from fieldcam.tui.widgets.cell_picture import BlockPicture, CellPicture
from fieldcam.tui.widgets.picture_view import NoPicture, PictureView


def picture_view(pictures: PictureStyle) -> PictureView:
    """The view for this terminal."""
    if pictures in PIXELS:
        # Needs the extra, and asks the terminal when it is imported.
        from fieldcam.tui.widgets.pixel_picture import PixelPicture

        return PixelPicture(pictures)
    kinds = {PictureStyle.CELLS: CellPicture, PictureStyle.NONE: NoPicture}
    return kinds.get(pictures, BlockPicture)()
