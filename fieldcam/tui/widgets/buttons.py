"""Buttons three rows high, for gloves; each does what its key does."""

from __future__ import annotations

from dataclasses import dataclass

from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.widgets import Button

from fieldcam.tui.text.telling import Tone


@dataclass(frozen=True, slots=True)
class Key:
    """A big button."""

    label: str
    action: str
    tone: Tone


CAPTURE = Key("CAPTURE  Space", "shoot", Tone.BUSY)
ACCEPT = Key("ACCEPT  Enter", "accept", Tone.GOOD)
RETAKE = Key("RETAKE  R", "retake", Tone.BAD)
FALLEN = Key("FALLEN  F", "fallen", Tone.ASK)
HIDDEN = Key("HIDDEN  H", "hidden", Tone.ASK)
COMPARE = Key("TWO DAYS  2", "two_days", Tone.PLAIN)
USUAL = (CAPTURE, ACCEPT, RETAKE)
QUESTION = (FALLEN, HIDDEN, COMPARE, RETAKE)
"""The answers to CONFIRM's one question, and what helps to find them."""
ALL = (CAPTURE, ACCEPT, FALLEN, HIDDEN, COMPARE, RETAKE)
"""As they stand from left to right, so that RETAKE never moves."""


class BigButton(Button, can_focus=False):
    """Never takes the focus, so that Space and Enter stay the walk's own keys."""


def big_button(key: Key) -> BigButton:
    """Found as `#do-ACTION`."""
    button = BigButton(key.label, id=f"do-{key.action}", action=f"screen.{key.action}")
    button.add_class(f"-{key.tone}")
    return button


class BigButtons(Horizontal):
    """One of the two rows of buttons is there at a time."""

    def compose(self) -> ComposeResult:
        for key in ALL:
            yield big_button(key)

    def show(self, question: bool) -> None:
        shown = QUESTION if question else USUAL
        for key in ALL:
            self.query_one(f"#do-{key.action}").display = key in shown
