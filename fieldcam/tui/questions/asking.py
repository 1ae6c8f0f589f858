"""Questions that take one key, or one short text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.events import Key
from textual.widgets import Input, Static

from fieldcam.tui.questions.dialog import Dialog
from fieldcam.tui.widgets.buttons import BigButton

Kind = Literal["text", "integer", "number"]
LONGEST = 200
"""Characters of a note."""


class AskYes(Dialog[bool]):
    """Y says yes, N or Escape no.

    Enter and the shutter's keys say nothing: they may have been meant for the screen below.
    """

    CSS_PATH = "asking.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("y", "answer(True)", "Yes"),
        Binding("n,escape", "answer(False)", "No"),
    ]

    def __init__(self, question: str) -> None:
        super().__init__()
        self._question = question

    def compose(self) -> ComposeResult:
        with Vertical(classes="box"):
            yield Static(self._question, markup=False)
            with Horizontal(classes="keys"):
                yield BigButton("YES  Y", action="screen.answer(True)")
                yield BigButton("NO  N", action="screen.answer(False)")

    def action_answer(self, yes: bool) -> None:
        self.dismiss(yes)


class Notice(Dialog[None]):
    """Sentences that the operator should have seen; any key closes it."""

    CSS_PATH = "asking.tcss"

    def __init__(self, sentences: Sequence[str]) -> None:
        super().__init__()
        self._sentences = tuple(sentences)

    def compose(self) -> ComposeResult:
        with Vertical(classes="box"):
            for sentence in self._sentences:
                yield Static(sentence, markup=False)
            yield Static("Any key: go on")

    def on_key(self, event: Key) -> None:
        event.stop()
        self.dismiss()

    def on_click(self) -> None:
        self.dismiss()


class AskText(Dialog[str | None]):
    """Enter takes the text, Escape drops it."""

    CSS_PATH = "asking.tcss"
    BINDINGS = [("escape", "drop", "Back")]  # noqa: RUF012 (Textual's own form)

    def __init__(self, question: str, kind: Kind = "text") -> None:
        """`kind` says whether only a whole number, or any number, is taken."""
        super().__init__()
        self._question, self._kind = question, kind

    def compose(self) -> ComposeResult:
        with Vertical(classes="box"):
            yield Static(self._question, markup=False)
            field = Input(type=self._kind, max_length=LONGEST)
            field.cursor_blink = False
            yield field
            yield Static("Enter: take it      Escape: back")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        if event.validation_result is None or event.validation_result.is_valid:
            self.dismiss(event.value)

    def action_drop(self) -> None:
        self.dismiss(None)
