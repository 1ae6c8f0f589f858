"""Questions with several fields, or with a list to choose from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, OptionList, Static
from textual.widgets.option_list import Option

from fieldcam.errors import BadInput
from fieldcam.tui.questions.asking import LONGEST
from fieldcam.tui.questions.dialog import Dialog
from fieldcam.tui.widgets.buttons import BigButton

Answer = TypeVar("Answer")


@dataclass(frozen=True, slots=True)
class Field:
    """One line to fill in."""

    label: str
    first: str = ""
    """What stands in it already."""
    check: Callable[[str], object] | None = None
    """Raises BadInput for what is wrong in it, as soon as the field is left."""


class AskForm(Dialog[Answer | None], Generic[Answer]):
    """Enter goes from field to field and takes the last one, Escape drops all."""

    CSS_PATH = "asking.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "drop", "Back"),
        Binding("down", "app.focus_next", "Next field", show=False),
        Binding("up", "app.focus_previous", "Field before", show=False),
    ]

    def __init__(self, question: str, fields: Sequence[Field], make: Callable[..., Answer]) -> None:
        """`make` gets the text of each field, and raises BadInput for what is wrong in it."""
        super().__init__()
        self._question, self._fields, self._make = question, tuple(fields), make

    def compose(self) -> ComposeResult:
        with Vertical(classes="box"):
            yield Static(self._question, markup=False)
            for field in self._fields:
                with Horizontal(classes="field"):
                    yield Label(field.label, markup=False)
                    yield Input(field.first, max_length=LONGEST)
            yield Static(id="wrong", markup=False)
            with Horizontal(classes="keys"):
                yield BigButton("NEXT  Enter", id="next", action="app.focus_next")
                yield BigButton("TAKE IT", id="take", action="screen.take")
                yield BigButton("BACK  Esc", action="screen.drop")

    def on_mount(self) -> None:
        for field in self.query(Input):
            field.cursor_blink = False

    def on_descendant_focus(self) -> None:
        """Enter takes the form in its last field only."""
        last = self.focused is self.query(Input).last()
        self.query_one("#next").display = not last
        self.query_one("#take", BigButton).label = "TAKE IT  Enter" if last else "TAKE IT"

    def on_input_blurred(self, event: Input.Blurred) -> None:
        """What is wrong is put right before the next field."""
        self._check(event.input)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        if event.input is self.query(Input).last():
            self.action_take()
        elif event.input is self.focused and self._check(event.input):
            self.focus_next()

    def action_take(self) -> None:
        if not all(self._check(each) for each in self.query(Input)):
            return
        try:
            answer = self._make(*(field.value for field in self.query(Input)))
        except BadInput as error:
            self.query_one("#wrong", Static).update(str(error))
        else:
            self.dismiss(answer)

    def action_drop(self) -> None:
        self.dismiss(None)

    def _check(self, line: Input) -> bool:
        """Says what is wrong in the line, and marks it and goes back to it."""
        field, wrong = self._fields[list(self.query(Input)).index(line)], ""
        try:
            if field.check is not None:
                field.check(line.value)
        except BadInput as error:
            wrong = str(error)
            line.focus()
        line.set_class(bool(wrong), "-wrong")
        if wrong or not self.query("Input.-wrong"):
            self.query_one("#wrong", Static).update(wrong)
        return not wrong


class AskChoice(Dialog[int | None]):
    """Gives the place of the line that was chosen; Escape chooses none."""

    CSS_PATH = "asking.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "drop", "Back")]

    def __init__(self, question: str, lines: Sequence[str]) -> None:
        super().__init__()
        self._question, self._lines = question, tuple(lines)

    def compose(self) -> ComposeResult:
        with Vertical(classes="box"):
            yield Static(self._question, markup=False)
            yield OptionList(*(Option(line) for line in self._lines), markup=False)
            with Horizontal(classes="keys"):
                yield BigButton("BACK  Esc", action="screen.drop")

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        self.dismiss(event.option_index)

    def action_drop(self) -> None:
        self.dismiss(None)
