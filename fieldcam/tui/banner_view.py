"""The verdict in huge letters, with shape, colour, count and sentence."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Static

from fieldcam.tui.letters import big, shape
from fieldcam.tui.telling import Banner, Tone

SCALES = ((2, 2), (2, 1), (1, 1))
"""Columns in a pixel of the word, and of its shape and count; the first that fits is taken."""
GAP = "   "


class BannerView(Vertical):
    """Shows one banner."""

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self._banner: Banner | None = None
        self._count = ""

    def compose(self) -> ComposeResult:
        yield Static(id="word", markup=False)
        yield Static(id="sentence", markup=False)

    def show(self, banner: Banner, count: str) -> None:
        """`count` is the target's, such as 5/6; empty where there is none."""
        for tone in Tone:
            self.set_class(tone is banner.tone, f"-{tone}")
        self._banner, self._count = banner, count
        self._draw(banner)
        self.query_one("#sentence", Static).update(banner.sentence)

    def on_resize(self) -> None:
        if self._banner is not None:
            self._draw(self._banner)

    def _draw(self, banner: Banner) -> None:
        drawn = (self._lines(banner, *scales) for scales in SCALES)
        fitting = (lines for lines in drawn if len(lines[0]) <= self.content_size.width)
        lines = next(fitting, self._lines(banner, *SCALES[-1]))
        self.query_one("#word", Static).update("\n".join(lines))

    def _lines(self, banner: Banner, scale: int, other: int) -> list[str]:
        parts = [big(banner.word, scale), shape(banner.shape, other)]
        if self._count:
            parts.append(big(self._count, other))
        return [GAP.join(row) for row in zip(*parts, strict=True)]
