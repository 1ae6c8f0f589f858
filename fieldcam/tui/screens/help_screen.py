"""The keys of the screen below, and what it is for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.events import Key
from textual.widgets import Static

from fieldcam.tui.keys import KeyCommand
from fieldcam.tui.questions.dialog import Dialog

KEY_WIDTH, COLUMN = 7, 38
CLOSE = "Any key closes this page."


class HelpScreen(Dialog[None]):
    """Shown over any other screen."""

    CSS_PATH = "help_screen.tcss"

    def __init__(self, about: str, commands: Sequence[KeyCommand]) -> None:
        """`about` says what the screen is for."""
        super().__init__()
        self._about, self._commands = about, tuple(commands)

    def compose(self) -> ComposeResult:
        with Vertical(id="keys"):
            yield Static("\n".join(help_lines(self._about, self._commands)), markup=False)

    def on_key(self, event: Key) -> None:
        event.stop()
        self.dismiss()

    def on_click(self) -> None:
        self.dismiss()


def help_lines(about: str, commands: Sequence[KeyCommand]) -> Iterator[str]:
    """What it is for, then the keys in two columns."""
    lines = [_line(command) for command in commands]
    half = (len(lines) + 1) // 2
    yield about
    yield ""
    for left, right in zip_longest(lines[:half], lines[half:], fillvalue=""):
        yield f"{left:{COLUMN}}{right}".rstrip()
    yield ""
    yield CLOSE


def _line(command: KeyCommand) -> str:
    return f"{command.key:{KEY_WIDTH}}{command.name}"
