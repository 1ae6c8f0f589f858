"""A screen that asks or tells something over another one."""

from __future__ import annotations

from textual.await_complete import AwaitComplete
from textual.screen import ModalScreen, ScreenResultType


class Dialog(ModalScreen[ScreenResultType]):
    """Is left once, however fast keys and clicks follow each other.

    Textual would take the screen below away with the second one.
    """

    def dismiss(self, result: ScreenResultType | None = None) -> AwaitComplete:
        """Leave it with this answer; an answer that comes after that is too late."""
        if self.app.screen is not self:
            return AwaitComplete()
        return super().dismiss(result)
