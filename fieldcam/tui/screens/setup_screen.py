"""The Set-up screen: who walks which block, and what is known of it."""

from __future__ import annotations

from typing import ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.message import Message
from textual.widgets import OptionList, Static
from textual.widgets.option_list import Option

from fieldcam.session.set_up.setting_up import SetUp, SetUpState
from fieldcam.tui.messages import Heard
from fieldcam.tui.questions.setup_questions import Change, Questions, carried_out
from fieldcam.tui.screens.page import FullScreen
from fieldcam.tui.text.setup_telling import Subject, lines
from fieldcam.tui.widgets.buttons import BigButton


class SetUpScreen(FullScreen):
    """Each line is changed by a question of its own."""

    CSS_PATH = "setup_screen.tcss"
    TITLE = "Set-up"
    about = "Set-up: arrows choose a line, Enter changes it. Everything may wait."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,e", "app.walk", "To the walk", key_display="Esc", tooltip="To the walk"),
        Binding("u", "undo", "Undo", tooltip="Undo the last change here"),
    ]

    class Looked(Message):
        """The store was read anew, in a thread."""

        def __init__(self, state: SetUpState) -> None:
            super().__init__()
            self.state = state

    def __init__(self, setup: SetUp) -> None:
        super().__init__()
        self._setup = setup
        self.state: SetUpState | None = None

    def body(self) -> ComposeResult:
        yield OptionList(id="subjects", markup=False)
        yield Static("Arrows choose a line, Enter changes it. Everything may wait.", id="hint")
        yield Static(id="said", markup=False)
        with Horizontal(id="buttons"):
            yield BigButton("CHANGE  Enter", action="screen.change", classes="-busy")
            yield BigButton("UNDO  U", action="screen.undo")
            yield BigButton("TO THE WALK  Esc", action="app.walk", classes="-good")

    def on_mount(self) -> None:
        self._look()

    def on_screen_resume(self) -> None:
        self.query_one(OptionList).focus()

    def on_set_up_screen_looked(self, message: Looked) -> None:
        self.state = state = message.state
        block = "" if state.block is None else state.block.name
        self.show_bar(block, state.day, state.simulated, state.free_bytes)
        options = self.query_one(OptionList)
        place = options.highlighted
        options.clear_options()
        options.add_options(
            Option(line.text, id=line.subject.name, disabled=not line.alive)
            for line in lines(state)
        )
        options.highlighted = place or 0

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        if self.state is not None and event.option_id is not None:
            subject = Subject[event.option_id]
            Questions(self.app, self._setup, self.state, self._write).ask(subject)

    def action_change(self) -> None:
        self.query_one(OptionList).action_select()

    def action_undo(self) -> None:
        self._write(self._setup.undo)

    @work(thread=True, group="set-up")
    def _write(self, change: Change) -> None:
        """Beside the screen, since another program may hold the database for a while."""
        self.app.post_message(Heard(carried_out(change)))
        self.post_message(self.Looked(self._setup.state()))

    @work(thread=True, group="set-up")
    def _look(self) -> None:
        self.post_message(self.Looked(self._setup.state()))
