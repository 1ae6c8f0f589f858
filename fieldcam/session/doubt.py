"""Why a command of the operator is not simply carried out."""

from __future__ import annotations

from enum import Enum, auto

from fieldcam.errors import BadInput
from fieldcam.session.set_up.today import AnotherDay


class Instead(Enum):
    """What the operator can do instead; screens know the words, and the keys."""

    ANSWER_OR_RETAKE = auto()
    MARK_UNSEEN = auto()
    """Fallen and hidden are for fruitlets that no picture shows."""
    COMPARE_DAYS = auto()
    """On Two days each missing fruitlet gets its answer."""
    SAY_TAG_OR_RETAKE = auto()
    RETAKE_OR_SAY_TAG = auto()
    UNDO_ANSWER = auto()
    UNDO_DECISION = auto()
    GIVE_TREES = auto()
    """A planned route says which tree each tag hangs in."""


class NotNow(BadInput):
    """The command makes no sense here; the sentence says why."""

    def __init__(self, message: str, instead: Instead | None = None) -> None:
        super().__init__(message)
        self.instead = instead


class NewDay(BadInput):
    """The calendar has gone on since the visit was opened: is a new one begun?"""

    def __init__(self, day: AnotherDay) -> None:
        super().__init__("The calendar has gone on since the visit was opened.")
        self.day = day


class Doubtful(BadInput):
    """Most likely a slip, but the operator may insist."""
