"""The tag's range against the working range, as a bar over the whole width."""

from __future__ import annotations

from fieldcam.tui.text.aim_telling import range_bar
from fieldcam.tui.widgets.words import Words


class RangeView(Words):
    """Shows one range, or the bar alone where it is not known."""

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id, markup=False)
        self._range_mm: float | None = None

    def show(self, range_mm: float | None) -> None:
        self._range_mm = range_mm
        self.update("\n".join(range_bar(range_mm, self.content_size.width)))

    def on_resize(self) -> None:
        self.show(self._range_mm)
