"""What a screen may ask of a walk; each command is a value, and what came of it is told later."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from fieldcam.growth.places import MatchWord, Place
from fieldcam.store.rows.judgements import Answer
from fieldcam.store.rows.row import EntryId


@dataclass(frozen=True, slots=True)
class StartPreview:
    """Tell what the camera sees, once or twice a second, until told to stop."""


@dataclass(frozen=True, slots=True)
class StopPreview:
    """Nobody aims any more."""


@dataclass(frozen=True, slots=True)
class Shoot:
    """Take the picture that is due; the camera's own shutter does the same."""


@dataclass(frozen=True, slots=True)
class SecondView:
    """Take a picture of the same cluster from another side, beside the last one."""


@dataclass(frozen=True, slots=True)
class Refresh:
    """Tell the state anew, since others wrote to the store."""


@dataclass(frozen=True, slots=True)
class RestartAnalysis:
    """Start it again after it was given up, with the pictures that wait."""


@dataclass(frozen=True, slots=True)
class Accept:
    """The picture counts; on to the next cluster."""


@dataclass(frozen=True, slots=True)
class Retake:
    """The picture does not count; the cluster waits for another one."""


@dataclass(frozen=True, slots=True)
class AnswerQuestion:
    """To CONFIRM's question; without one, mark a fruitlet that no picture shows."""

    answer: Answer


@dataclass(frozen=True, slots=True)
class CorrectTag:
    """The picture shows this tag; it is read again with what is expected there."""

    tag_id: int


@dataclass(frozen=True, slots=True)
class OtherTarget:
    """The next cluster of the picture is the tagged one."""


@dataclass(frozen=True, slots=True)
class Strike:
    """This is no fruitlet."""

    fruitlet: int


OnShown = Accept | Retake | AnswerQuestion | CorrectTag | OtherTarget | Strike
"""Decisions on the picture that is shown."""


@dataclass(frozen=True, slots=True)
class AcceptPicture:
    """A picture of any visit counts, before whose cluster nobody may stand now."""

    capture: EntryId


@dataclass(frozen=True, slots=True)
class TellMissing:
    """Why a picture of any visit does not show one fruitlet.

    With the last one the picture counts.
    """

    capture: EntryId
    place: Place | None
    """Where an earlier picture shows it; None where that has no depth."""
    answer: Answer


@dataclass(frozen=True, slots=True)
class CrownKing:
    """This fruitlet of any picture is the cluster's king; the last word counts."""

    capture: EntryId
    fruitlet: int


@dataclass(frozen=True, slots=True)
class AddByHand:
    """A fruitlet that the picture's reading does not have, measured by hand."""

    capture: EntryId
    diameter_mm: float


@dataclass(frozen=True, slots=True)
class NameFruit:
    """This fruitlet is the fruit of this name, with this size by caliper on that day.

    Without a name it keeps the one that it has, else gets the cluster's next free number.
    """

    capture: EntryId
    fruitlet: int
    fruit: str
    diameter_mm: float | None = None


@dataclass(frozen=True, slots=True)
class MatchFruit:
    """Which fruitlet of one picture is which of another."""

    word: MatchWord


@dataclass(frozen=True, slots=True)
class WriteNote:
    """On the picture; without one, on the visit."""

    text: str


@dataclass(frozen=True, slots=True)
class SkipCluster:
    """Leave this cluster out today."""


@dataclass(frozen=True, slots=True)
class GoTo:
    """Stand at another cluster."""

    tag_id: int


@dataclass(frozen=True, slots=True)
class Step:
    """Stand at the route's next or previous cluster, whatever its state."""

    by: int


@dataclass(frozen=True, slots=True)
class NextTree:
    """On to the next tree: to its first cluster that needs a picture, or to learn it."""


@dataclass(frozen=True, slots=True)
class UndoLast:
    """Take back the newest command that was written."""


@dataclass(frozen=True, slots=True)
class UndoMatch:
    """Take back the last match that was said of this cluster."""

    tag_id: int


@dataclass(frozen=True, slots=True)
class UndoFruit:
    """Take back the last name, size or king of this cluster's fruitlets."""

    tag_id: int


Writing = (
    OnShown
    | AcceptPicture
    | TellMissing
    | CrownKing
    | AddByHand
    | NameFruit
    | MatchFruit
    | WriteNote
    | SkipCluster
    | GoTo
    | Step
    | NextTree
    | UndoLast
    | UndoMatch
    | UndoFruit
)
"""Commands that are rows, and nothing else."""
Command = StartPreview | StopPreview | Shoot | SecondView | Refresh | RestartAnalysis | Writing


class Walk(Protocol):
    """`session.live.LiveWalk` is one; its listener hears what came of a command."""

    def do(self, command: Command) -> None:
        """Returns at once."""
        ...

    def close(self) -> None: ...
