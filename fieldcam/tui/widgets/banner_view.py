"""The verdict in huge letters, with shape, colour, count and sentence."""

from __future__ import annotations

from collections.abc import Iterable

from textual.app import ComposeResult
from textual.containers import Vertical

from fieldcam.tui.text.letters import HEIGHT, big, shape
from fieldcam.tui.text.telling import Banner, Tone
from fieldcam.tui.widgets.words import Words

SCALES = ((2, 2), (2, 1), (1, 1))
"""Columns in a pixel of the word, and of its shape and count; the first that fits is taken."""
GAP = "   "


class BannerView(Vertical):
    """Shows one banner; count and shape stand under the word where there is height for it."""

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self._banner: Banner | None = None
        self._count = ""

    def compose(self) -> ComposeResult:
        yield Words(id="word", markup=False)
        yield Words(id="sentence", markup=False)

    def show(self, banner: Banner, count: str) -> None:
        """`count` is the target's, such as 5/6; empty where there is none."""
        for tone in Tone:
            self.set_class(tone is banner.tone, f"-{tone}")
        self._banner, self._count = banner, count
        self._draw(banner)
        self.query_one("#sentence", Words).update(banner.sentence)

    def on_resize(self) -> None:
        if self._banner is not None:
            self._draw(self._banner)

    def _draw(self, banner: Banner) -> None:
        word = self.query_one("#word", Words)
        if word.content_size.height > 2 * HEIGHT:
            lines = [
                *self._fitting(big(banner.word, scale) for scale, _ in SCALES),
                "",
                *self._fitting(self._beside(banner, other) for _, other in SCALES),
            ]
        else:
            lines = self._fitting(
                _side_by_side(big(banner.word, scale), self._beside(banner, other))
                for scale, other in SCALES
            )
        word.update("\n".join(lines))

    def _fitting(self, drawn: Iterable[list[str]]) -> list[str]:
        """The first that fits the width, else the last."""
        lines: list[str] = []
        for lines in drawn:
            if len(lines[0]) <= self.content_size.width:
                break
        return lines

    def _beside(self, banner: Banner, scale: int) -> list[str]:
        drawn = shape(banner.shape, scale)
        return _side_by_side(drawn, big(self._count, scale)) if self._count else drawn


def _side_by_side(left: list[str], right: list[str]) -> list[str]:
    return [GAP.join(row) for row in zip(left, right, strict=True)]
