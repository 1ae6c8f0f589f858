"""The session loop: capture, save, analyse, report; one cluster after the other.

Save comes first and is durable before the analysis starts, so that nothing the
analysis does can cost a picture. Errors of the analysis become events and the
walk goes on; errors of the camera or the store end it, since nothing more can
be saved.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol

from fieldcam.camera.port import FlashStereoDevice
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import FieldcamError
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Expectation, RawPair

DEADLINE_S = 5.0
"""How long a triggered pair may take to arrive."""


class VisitRecord(Protocol):
    """What is kept of one visit of a block."""

    def save(self, raw: RawPair, expectation: Expectation) -> SavedCapture:
        """Make the pair durable, before anything else happens to it."""
        ...

    def keep(self, saved: SavedCapture, reading: EncodedReading, duration_ms: float) -> None:
        """Keep what a saved pair says."""
        ...

    def fail(self, saved: SavedCapture, error: FieldcamError) -> None:
        """Keep why a saved pair says nothing."""
        ...


class Analyst(Protocol):
    """Turns a saved pair into a reading."""

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> EncodedReading:
        """The reading of one saved pair; raises FieldcamError where there can be none."""
        ...


@dataclass(frozen=True, slots=True)
class Saved:
    """A pair is safe on the disk."""

    capture: SavedCapture
    duration_ms: float
    """From the pair in memory to durable."""


@dataclass(frozen=True, slots=True)
class Analysed:
    """A saved pair was read."""

    capture: SavedCapture
    reading: EncodedReading
    duration_ms: float


@dataclass(frozen=True, slots=True)
class NotAnalysed:
    """A saved pair could not be read; the picture is kept."""

    capture: SavedCapture
    error: FieldcamError


WalkEvent = Saved | Analysed | NotAnalysed


def walk(
    camera: FlashStereoDevice,
    record: VisitRecord,
    analyst: Analyst,
    clusters: Iterable[Expectation],
    deadline_s: float = DEADLINE_S,
) -> Iterator[WalkEvent]:
    """Take one capture of each cluster and yield what happens, as it happens.

    `clusters` is consumed one at a time, after the events of the cluster before,
    so that it may depend on them.
    """
    for expectation in clusters:
        raw = camera.capture(deadline_s)
        started = perf_counter()
        saved = record.save(raw, expectation)
        yield Saved(saved, _since_ms(started))
        yield analyse(record, analyst, saved, expectation)


def analyse(
    record: VisitRecord, analyst: Analyst, saved: SavedCapture, expectation: Expectation
) -> Analysed | NotAnalysed:
    """Read a saved pair and keep what came of it."""
    started = perf_counter()
    try:
        reading = analyst.analyse(saved, expectation)
    except FieldcamError as error:
        record.fail(saved, error)
        return NotAnalysed(saved, error)
    duration_ms = _since_ms(started)
    record.keep(saved, reading, duration_ms)
    return Analysed(saved, reading, duration_ms)


def _since_ms(started: float) -> float:
    return (perf_counter() - started) * 1000
