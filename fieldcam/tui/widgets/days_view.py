"""A cluster's sizes day by day."""

from __future__ import annotations

from collections.abc import Sequence

from textual.app import ComposeResult
from textual.containers import VerticalScroll
from textual.widgets import Static

from fieldcam.session.over_days.days import ClusterDay
from fieldcam.tui.text.history_words import day_lines


class Past(VerticalScroll, can_focus=False):
    """Never takes the focus, so that the arrows stay the screen's own keys."""


class DaysView(Past):
    """The last day is in view."""

    def __init__(self) -> None:
        super().__init__(id="days")

    def compose(self) -> ComposeResult:
        yield Static(id="day-lines", markup=False)

    def show(self, days: Sequence[ClusterDay]) -> None:
        self.query_one("#day-lines", Static).update("\n".join(day_lines(days)))
        self.scroll_end(animate=False)
