"""What a screen shows of a walk at one moment."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import date
from enum import StrEnum
from pathlib import Path

from fieldcam.analysis.status import AnalysisStatus
from fieldcam.session.summary import WalkSummary
from fieldcam.store.queries.history import CaptureRecord, ClusterMark, FruitletSeen
from fieldcam.store.queries.walks import Progress, WalkRoute
from fieldcam.store.rows.row import EntryId
from fieldcam.values import ClusterReading, PixelFormat, Status


class CameraState(StrEnum):
    """Whether a picture can be taken."""

    OPENING = "opening"
    READY = "ready"
    EXPOSING = "exposing"
    LOST = "lost"
    """The next capture tries to open it again."""


class Stage(StrEnum):
    """How far a saved picture is."""

    ANALYSING = "analysing"
    READ = "read"
    FAILED = "failed"
    """Without a reading; the picture is kept."""


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """The picture that the operator decides on: the last one of the cluster."""

    record: CaptureRecord
    left: Path
    """As the camera gave it, PGM or PPM; PNG or JPEG where it was imported so."""
    right: Path
    pixel_format: PixelFormat
    reading: ClusterReading | None
    failure: str
    """Why it has no reading; empty while it may still get one."""
    corrected: bool
    """The operator said which tag it shows."""

    @property
    def id(self) -> EntryId:
        return self.record.id

    @property
    def stage(self) -> Stage:
        if self.reading is not None:
            return Stage.READ
        return Stage.FAILED if self.failure else Stage.ANALYSING

    @property
    def status(self) -> Status | None:
        """The verdict as it was given; None without a reading."""
        return None if self.reading is None else self.reading.verdict.status

    @property
    def target(self) -> tuple[FruitletSeen, ...]:
        """Fruitlets of the target cluster, with corrections and marks applied."""
        return () if self.record.reading is None else self.record.reading.target

    @property
    def living(self) -> int | None:
        """Fruitlets of the target cluster that count."""
        return None if self.record.reading is None else self.record.reading.living

    @property
    def wrong_tag(self) -> int | None:
        """The tag that was read where another one was due and nobody said which it is."""
        read = None if self.record.reading is None else self.record.reading.tag_read
        return None if self.corrected or read in (None, self.record.tag_id) else read


@dataclass(frozen=True, slots=True, eq=False)
class WalkState:
    """A walk of one block on one day."""

    block: str
    day: date
    simulated: bool
    tag_id: int | None
    """Where the operator stands; None: all clusters are done, or a new one is to be learned."""
    next_tag: int | None
    """What comes after it."""
    progress: Progress | None
    before: int | None
    """Living fruitlets of this cluster on the last visit."""
    shown: Shown | None
    route: WalkRoute
    folder: Path = Path()
    """The data folder, for screens that look further back."""
    tree: str = ""
    """Label of the tree that is walked; empty where it is not known."""
    learning: bool = False
    """The next picture's tag joins the route of this tree."""
    marks: tuple[ClusterMark, ...] = ()
    """Fruitlets of this cluster that no picture of today shows."""
    warnings: tuple[str, ...] = ()
    """What is odd about the picture's tag."""
    seconds_per_cluster: float | None = None
    free_bytes: int = 0
    waiting: int = 0
    """Saved pictures of this visit that are to be read."""
    failed: int = 0
    """Those that could not be read; the operator may have them read again."""
    camera: CameraState = CameraState.READY
    camera_trouble: str = ""
    """Why the camera is lost, and what to do, in the camera's own words."""
    afterwards: str = ""
    """What can be done when all clusters are done, besides to end the walk."""
    summary: WalkSummary | None = None
    """Where no cluster is due any more."""
    patience: str = ""
    """Why this camera takes its time, where it does; for who waits for a picture."""
    camera_notes: tuple[str, ...] = ()
    """What was not as it should be when the camera was opened, and stops no picture."""
    uncalibrated: str = ""
    """Why pictures are saved and not read; empty where they are."""
    analysis: AnalysisStatus = field(default_factory=AnalysisStatus)

    @property
    def missing(self) -> int:
        """How many fruitlets CONFIRM asks about: fallen, or hidden?"""
        return 0 if self.shown is None else missing(self.shown.record, self.before)

    @property
    def more(self) -> int:
        """How many fruitlets the last visit did not know: hidden then, or not of this cluster?"""
        return 0 if self.shown is None else more(self.shown.record, self.before)

    @property
    def told(self) -> int:
        """How many of the missing were told already."""
        return sum(mark.count for mark in self.marks)


def missing(record: CaptureRecord, before: int | None) -> int:
    """Fruitlets fewer than last visit, where that is still to be decided on."""
    return max(0, -_unexpected(record, before))


def more(record: CaptureRecord, before: int | None) -> int:
    """Fruitlets more than last visit, where that is still to be decided on."""
    return max(0, _unexpected(record, before))


def _unexpected(record: CaptureRecord, before: int | None) -> int:
    reading, decided = record.reading, record.action is not None
    if before is None or reading is None or decided or reading.status is Status.RETAKE:
        return 0
    return reading.living - before
