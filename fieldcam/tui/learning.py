"""Learns the key that a remote sends, whatever it is."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.events import Key
from textual.screen import ModalScreen
from textual.widgets import Static


class LearnKey(ModalScreen[str | None]):
    """Gives the name of the next key; Escape gives none."""

    CSS_PATH = "asking.tcss"

    def compose(self) -> ComposeResult:
        with Vertical(classes="box"):
            yield Static("Press the remote's button.      Escape: back")

    def on_key(self, event: Key) -> None:
        event.stop()
        self.dismiss(None if event.key == "escape" else event.key)
