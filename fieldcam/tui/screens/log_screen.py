"""The Log screen: what happened on this walk, the newest line last."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Static

from fieldcam.session.commands import Walk
from fieldcam.session.state import WalkState
from fieldcam.tui.screens.page import Page
from fieldcam.tui.text.news import News


class LogScreen(Page):
    """Lines that are kept elsewhere; nothing is lost by closing it."""

    CSS_PATH = "log_screen.tcss"
    TITLE = "Log"
    about = "Log: what happened on this walk, the newest last."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,l", "app.pop_screen", "Back to the walk", tooltip="Back")
    ]

    def __init__(self, walk: Walk, state: WalkState | None, lines: Sequence[str]) -> None:
        super().__init__(walk, state)
        self._lines = lines

    def body(self) -> ComposeResult:
        with VerticalScroll(id="lines"):
            yield Static(id="text", markup=False)
        yield Static(id="analysis", markup=False)

    def hear(self, told: News) -> None:
        """It is among the lines."""
        self._write()

    def show(self, state: WalkState) -> None:
        super().show(state)
        self._write()
        status = state.analysis
        said = f"camera {state.camera}, analysis {status.state}, restarts {status.restarts}"
        self.query_one("#analysis", Static).update(f"{said}   {status.last_error}".rstrip())

    def _write(self) -> None:
        self.query_one("#text", Static).update("\n".join(self._lines))
        self.query_one("#lines").scroll_end(animate=False)
