"""Learns the key that a remote sends, whatever it is."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.events import Key
from textual.widgets import Static

from fieldcam.tui.questions.dialog import Dialog


class LearnKey(Dialog[str | None]):
    """Gives the name of the next key; Escape gives none."""

    CSS_PATH = "asking.tcss"

    def compose(self) -> ComposeResult:
        with Vertical(classes="box"):
            yield Static("Press the remote's button.      Escape: back")

    def on_key(self, event: Key) -> None:
        event.stop()
        self.dismiss(None if event.key == "escape" else event.key)
