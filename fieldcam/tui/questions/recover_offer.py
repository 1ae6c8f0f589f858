"""What is asked where the database is damaged, or is not that of the pictures."""

from __future__ import annotations

from pathlib import PurePath
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Static

from fieldcam.errors import StorageError
from fieldcam.tui.ending import EndableApp, ended_by_signals
from fieldcam.tui.themes import DARK
from fieldcam.tui.widgets.buttons import BigButton

WHAT_IT_DOES = (
    "Recovering keeps the database as it is under another name, takes over what can be read of"
    " it, and makes rows of the pictures. Until then nothing is written."
)


class RecoverOffer(EndableApp[bool]):
    """R recovers; anything else leaves all as it is."""

    CSS_PATH: ClassVar[list[str | PurePath]] = ["../buttons.tcss", "offer.tcss"]
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("r", "recover", "Recover"),
        Binding("q,escape,ctrl+c", "quit", "End"),
    ]

    def __init__(self, trouble: StorageError) -> None:
        super().__init__()
        self._trouble = trouble
        self.register_theme(DARK)
        self.theme = DARK.name

    def compose(self) -> ComposeResult:
        with Vertical(id="offer"):
            yield Static(self._trouble.message, markup=False)
            with Horizontal(id="choices"):
                yield BigButton("END  Q", action="app.quit", classes="-good")
                yield BigButton("RECOVER  R", action="app.recover", classes="-busy")
            yield Static(WHAT_IT_DOES)

    def action_recover(self) -> None:
        self.exit(True)


def may_recover(trouble: StorageError) -> bool:
    """Ask; raises Stopped where a signal ended it."""
    offer = RecoverOffer(trouble)
    with ended_by_signals(offer):
        wanted = offer.run()
    offer.raise_defect()
    return bool(wanted)
