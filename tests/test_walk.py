"""The session loop saves before it analyses, and goes on after a failed analysis."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

import numpy as np
import pytest
from made_readings import encoded, made_fruitlet, made_reading

from fieldcam.camera.preview import Preview
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import CameraUnplugged, FieldcamError, ModelMissing, StorageFull
from fieldcam.session.walk import Analysed, NotAnalysed, Saved, walk
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Calibration, Expectation, PixelFormat, RawPair


class FakeCamera:
    """Gives `pairs` pairs, then is unplugged."""

    serials = ("L", "R")
    calibration: Calibration | None = None
    notes: tuple[str, ...] = ()

    def __init__(self, log: list[str], pairs: int) -> None:
        self._log = log
        self._pairs = pairs

    def capture(self, deadline_s: float) -> RawPair:
        if self._pairs == 0:
            raise CameraUnplugged("No camera answers.")
        self._pairs -= 1
        self._log.append("capture")
        image = np.zeros((2, 2), np.uint8)
        now = datetime(2026, 5, 21, tzinfo=UTC)
        return RawPair(image, image, PixelFormat.MONO8, now, 0, 0, "L", "R", 1)

    def preview(self, deadline_s: float) -> Preview | None:
        return None

    def attend(self) -> None:
        """It is always there."""

    def watch_shutter(self, pressed: Callable[[], None]) -> None:
        pass

    def close(self) -> None:
        self._log.append("close")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class FakeStore:
    def __init__(self, log: list[str], error: FieldcamError | None = None) -> None:
        self._log = log
        self._error = error

    def save(self, raw: RawPair, expectation: Expectation) -> SavedCapture:
        if self._error is not None:
            raise self._error
        self._log.append("save")
        return SavedCapture(str(len(self._log)), Path("l"), Path("r"), Path("c"))

    def keep(self, saved: SavedCapture, reading: EncodedReading, duration_ms: float) -> None:
        self._log.append("keep")

    def fail(self, saved: SavedCapture, error: FieldcamError) -> None:
        self._log.append(f"fail: {error.message}")


class FakeAnalyst:
    def __init__(self, log: list[str], error: FieldcamError | None = None) -> None:
        self._log = log
        self._error = error
        self.expectations: list[Expectation] = []

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> EncodedReading:
        self._log.append("analyse")
        self.expectations.append(expectation)
        if self._error is not None:
            raise self._error
        fruitlets = [made_fruitlet(0, (100.0, 100.0))]
        return encoded(made_reading(fruitlets, expectation=expectation))


def test_each_pair_is_saved_before_it_is_analysed() -> None:
    log: list[str] = []
    visits = [Expectation(8), Expectation(9)]
    events = list(walk(FakeCamera(log, 2), FakeStore(log), FakeAnalyst(log), visits))
    assert log == ["capture", "save", "analyse", "keep"] * 2
    assert [type(event) for event in events] == [Saved, Analysed] * 2


def test_saved_is_announced_before_the_analysis_starts() -> None:
    log: list[str] = []
    events = walk(FakeCamera(log, 1), FakeStore(log), FakeAnalyst(log), [Expectation()])
    assert isinstance(next(events), Saved)
    assert log == ["capture", "save"]


def test_a_failed_analysis_keeps_the_picture_and_the_walk() -> None:
    log: list[str] = []
    analyst = FakeAnalyst(log, ModelMissing("No network."))
    events = list(walk(FakeCamera(log, 2), FakeStore(log), analyst, [Expectation()] * 2))
    assert [type(event) for event in events] == [Saved, NotAnalysed] * 2
    saved, failed = events[:2]
    assert saved.capture == failed.capture
    assert log[-1] == "fail: No network."


def test_an_expectation_may_depend_on_the_visit_before() -> None:
    log: list[str] = []
    analyst = FakeAnalyst(log)
    counted: list[int] = []

    def visits() -> Iterator[Expectation]:
        yield Expectation(8)
        yield Expectation(8, counted[-1])

    for event in walk(FakeCamera(log, 2), FakeStore(log), analyst, visits()):
        if isinstance(event, Analysed):
            counted.append(len(event.reading.form.target))
    assert analyst.expectations == [Expectation(8), Expectation(8, 1)]


def test_a_full_disk_ends_the_walk_before_any_analysis() -> None:
    log: list[str] = []
    store = FakeStore(log, StorageFull("No room."))
    with pytest.raises(StorageFull):
        list(walk(FakeCamera(log, 1), store, FakeAnalyst(log), [Expectation()]))
    assert log == ["capture"]


def test_an_unplugged_camera_ends_the_walk_after_what_it_gave() -> None:
    log: list[str] = []
    events = walk(FakeCamera(log, 1), FakeStore(log), FakeAnalyst(log), [Expectation()] * 2)
    assert isinstance(next(events), Saved)
    assert isinstance(next(events), Analysed)
    with pytest.raises(CameraUnplugged):
        next(events)
