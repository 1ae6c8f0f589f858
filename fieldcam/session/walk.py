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
from fieldcam.errors import FieldcamError
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ClusterReading, Expectation, RawPair

DEADLINE_S = 5.0
"""How long a triggered pair may take to arrive."""


class CaptureStore(Protocol):
    """Where raw pairs go before anything else happens to them."""

    def save(self, raw: RawPair) -> SavedCapture:
        """Make the pair durable."""
        ...


class Analyst(Protocol):
    """Turns a saved pair into a reading."""

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
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
    reading: ClusterReading
    duration_ms: float


@dataclass(frozen=True, slots=True)
class NotAnalysed:
    """A saved pair could not be read; the picture is kept."""

    capture: SavedCapture
    error: FieldcamError


WalkEvent = Saved | Analysed | NotAnalysed


def walk(
    camera: FlashStereoDevice,
    store: CaptureStore,
    analyst: Analyst,
    visits: Iterable[Expectation],
    deadline_s: float = DEADLINE_S,
) -> Iterator[WalkEvent]:
    """Take one capture for each visit and yield what happens, as it happens.

    `visits` is consumed one at a time, after the events of the visit before, so
    that it may depend on them.
    """
    for expectation in visits:
        raw = camera.capture(deadline_s)
        started = perf_counter()
        saved = store.save(raw)
        yield Saved(saved, _since_ms(started))
        yield _analyse(analyst, saved, expectation)


def _analyse(
    analyst: Analyst, saved: SavedCapture, expectation: Expectation
) -> Analysed | NotAnalysed:
    started = perf_counter()
    try:
        reading = analyst.analyse(saved, expectation)
    except FieldcamError as error:
        return NotAnalysed(saved, error)
    return Analysed(saved, reading, _since_ms(started))


def _since_ms(started: float) -> float:
    return (perf_counter() - started) * 1000
