"""Asks whether a command that is doubted is meant all the same."""

from __future__ import annotations

from collections.abc import Callable

from textual.app import App

from fieldcam.session.events import Doubted
from fieldcam.session.state import Stage, WalkState
from fieldcam.store.rows.row import EntryId
from fieldcam.tui.questions.asking import AskYes
from fieldcam.tui.text.news import News

Subject = tuple[int | None, EntryId | None, Stage | None]
"""A tag, its picture, and how far that is."""


class Doubts:
    """One question at a time, on top of the screen."""

    def __init__(self, app: App[None], tell: Callable[[News], None]) -> None:
        self._app, self._tell = app, tell
        self._open: tuple[AskYes, Subject] | None = None
        """The question, and what it is about."""

    def ask(self, doubt: Doubted, state: WalkState | None) -> None:
        def answered(yes: bool | None) -> None:
            self._open = None
            if yes:
                doubt.insist()
            elif yes is None:
                self._tell(News("Nothing was done: there is news of the picture."))
            else:
                self._tell(News("Nothing was done."))

        question = AskYes(doubt.sentence)
        self._open = question, _subject(state)
        self._app.push_screen(question, answered)

    def withdraw(self, state: WalkState) -> None:
        """A question goes when what it is about has changed: its words may be true no more."""
        if self._open is not None and self._open[1] != _subject(state):
            self._open[0].dismiss(None)


def _subject(state: WalkState | None) -> Subject:
    """What a question of this moment is about."""
    if state is None:
        return None, None, None
    if state.shown is None:
        return state.tag_id, None, None
    return state.tag_id, state.shown.id, state.shown.stage
