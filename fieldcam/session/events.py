"""What a live walk tells its listener, from threads of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fieldcam.errors import FieldcamError
from fieldcam.session.aim.cue import Cue
from fieldcam.session.state import WalkState
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ImageU8, Verdict


@dataclass(frozen=True, slots=True)
class CameraReady:
    """The camera was opened."""

    missed: str = ""
    """Why a picture that was asked for before was not taken; empty where none was missed."""
    notes: tuple[str, ...] = ()
    """What is not as it should be with it, in its own words."""


@dataclass(frozen=True, slots=True)
class CameraTrouble:
    """No picture was taken."""

    error: FieldcamError
    lost: bool = True
    """The camera has to be opened again; else only the picture was spoiled."""


@dataclass(frozen=True, slots=True)
class Saved:
    """A picture is safe on the disk."""

    capture: SavedCapture
    tag_id: int | None
    duration_ms: float
    """From the pair in memory to durable."""


@dataclass(frozen=True, slots=True)
class StorageTrouble:
    """Something could not be written; a picture that was not announced as saved is not."""

    error: FieldcamError


@dataclass(frozen=True, slots=True)
class Damaged:
    """Something that was stored before is not what was written."""

    sentence: str


@dataclass(frozen=True, slots=True)
class VerdictReady:
    """A saved picture was read."""

    capture: SavedCapture
    tag_id: int | None
    verdict: Verdict
    duration_ms: float
    """From saved to reading."""
    more: int = 0
    """Fruitlets that the last visit did not know, which is a question."""


@dataclass(frozen=True, slots=True)
class AnalysisTrouble:
    """A saved picture could not be read; it is kept."""

    capture: SavedCapture
    tag_id: int | None
    error: FieldcamError


@dataclass(frozen=True, slots=True)
class Done:
    """A command was carried out."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Refused:
    """A command was not carried out, and why."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Doubted:
    """A command that is carried out only when the operator insists."""

    sentence: str
    insist: Callable[[], None]


@dataclass(frozen=True, slots=True)
class DayDoubted:
    """A picture waits for the answer to whether a new visit begins."""

    sentence: str


@dataclass(frozen=True, slots=True, eq=False)
class Previewed:
    """What the camera sees while the operator aims."""

    picture: ImageU8
    """(h, w) grey or (h, w, 3) RGB, a few hundred pixels wide."""
    cue: Cue


@dataclass(frozen=True, slots=True)
class Changed:
    """The walk's new state; comes after the events that led to it."""

    state: WalkState


ShutterEvent = CameraReady | CameraTrouble | Saved | StorageTrouble
LiveEvent = (
    ShutterEvent
    | Damaged
    | VerdictReady
    | AnalysisTrouble
    | Done
    | Refused
    | Doubted
    | DayDoubted
    | Previewed
    | Changed
)
Listener = Callable[[LiveEvent], None]
