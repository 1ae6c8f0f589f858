"""Text that costs nothing while it stays the same."""

from __future__ import annotations

from textual.visual import VisualType
from textual.widgets import Static


class Words(Static):
    """A `Static` for what is told anew with every state, changed or not.

    Textual lays out the whole screen when a `Static` is updated; here only where the
    text may take more or less room than before.
    """

    def update(self, content: VisualType = "", *, layout: bool = True) -> None:
        if content != self.content:
            super().update(content, layout=layout and self.styles.auto_dimensions)
