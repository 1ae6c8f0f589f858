"""The live preview, in half blocks; a new one comes once or twice a second."""

from __future__ import annotations

from textual.strip import Strip
from textual.widget import Widget

from fieldcam.images.pixels import as_rgb
from fieldcam.tui.looks import PictureStyle
from fieldcam.tui.widgets.cell_picture import full_cells, half_blocks
from fieldcam.tui.widgets.picture import frame_of, shrink
from fieldcam.values import ImageU8


class PreviewView(Widget):
    """Shows the last picture of the left eye, blank before there is one."""

    def __init__(self, pictures: PictureStyle, id: str | None = None) -> None:
        super().__init__(id=id)
        self.display = pictures is not PictureStyle.NONE
        self._halves = 1 if pictures is PictureStyle.CELLS else 2
        self._picture: ImageU8 | None = None
        self._strips: list[Strip] = []

    def show(self, picture: ImageU8 | None) -> None:
        """(h, w) grey or (h, w, 3) RGB."""
        self._picture = picture
        self._redraw()

    def on_resize(self) -> None:
        self._redraw()

    def render_line(self, y: int) -> Strip:
        if y < len(self._strips):
            return self._strips[y]
        return Strip.blank(self.size.width, self.rich_style)

    def _redraw(self) -> None:
        width, height = self.size
        self._strips = []
        if self._picture is not None and width and height:
            picture = self._picture
            colours = as_rgb(picture)
            size = (width, height * self._halves)
            frame = frame_of(None, (picture.shape[1], picture.shape[0]), size)
            small = shrink(colours, frame, size)
            self._strips = half_blocks(small) if self._halves == 2 else full_cells(small)
        self.refresh()
