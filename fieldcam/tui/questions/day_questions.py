"""What is asked before a visit of a doubtful day, and once a visit has outlived its day."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date

from textual.app import App

from fieldcam.errors import StorageError
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.session.set_up.today import AnotherDay, told
from fieldcam.tui.questions import answers
from fieldcam.tui.questions.asking import AskYes
from fieldcam.tui.questions.forms import AskForm, Field
from fieldcam.tui.text.news import News

DAY = Field("Day, such as 2026-05-19")
CORRECTED = "Set-up (E) corrects the days of visits."


def day_question(day: AnotherDay) -> str:
    """Asked where the calendar has gone on while a visit was walked."""
    of_visit, now = told(day.of_visit), told(day.now)
    return (
        f"This walk is of {of_visit}, and the clock says {now} now. Begin a visit of"
        f" {now}? N goes on with that of {of_visit}."
    )


class DayQuestions:
    """Asks on top of the screen."""

    def __init__(
        self,
        app: App[None],
        setup: SetUp,
        open_visit: Callable[[date, News | None], None],
        tell: Callable[[News], None],
    ) -> None:
        """`open_visit` begins a walk of a day, with news of it."""
        self._app, self._setup = app, setup
        self._open_visit, self._tell = open_visit, tell
        self._asking = False

    def before_a_visit(self) -> None:
        """A block of another season is not walked on by accident."""

        def answered(yes: bool | None) -> None:
            if yes:
                self._before_a_day()
            else:
                self._tell(News("Choose the block of this season, or make one.", bad=True))

        if (doubt := self._setup.season_doubt()) is None:
            self._before_a_day()
        else:
            self._app.push_screen(AskYes(doubt), answered)

    def once_the_day_is_over(self) -> None:
        """One question at a time, however often the shutter is pressed."""
        try:
            day = self._setup.another_day()
        except StorageError:
            return  # the next picture asks
        if day is None or self._asking:
            return

        def answered(yes: bool | None) -> None:
            self._asking = False
            if yes:
                self._open_visit(self._setup.today(), None)
            else:
                self._tell(News(f"{self._setup.keep_day()} {CORRECTED}"))

        self._asking = True
        self._app.push_screen(AskYes(day_question(day)), answered)

    def _before_a_day(self) -> None:
        """Whatever the answer, pictures can be taken: the visit has the day that is given."""
        today = self._setup.today()

        def answered(yes: bool | None) -> None:
            if yes:
                self._open_visit(today, None)
            else:
                self._app.push_screen(AskForm("Which day is it?", [DAY], answers.day), given)

        def given(day: date | None) -> None:
            clocks = News(f"The visit is of {today}, as the clock says. {CORRECTED}", bad=True)
            self._open_visit(day or today, clocks if day is None else None)

        if (doubt := self._setup.doubt()) is None:
            self._open_visit(today, None)
        else:
            self._app.push_screen(AskYes(doubt), answered)
