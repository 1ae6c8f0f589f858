"""Folders of small recorded pairs, and an analyst that reads whatever it is given, at once."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from made_readings import TAG, encoded, made_fruitlet, made_reading

from fieldcam.analysis.work import DirectAnalyst
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import FieldcamError
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Expectation, Reason, ReasonCode, Status, Verdict

WIDTH, HEIGHT = 64, 48
CAMERA_INFO = """\
height: {height}
width: {width}
distortion_model: "plumb_bob"
D: [0.0, 0.0, 0.0, 0.0, 0.0]
K: [80.0, 0.0, 32.0, 0.0, 80.0, 24.0, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [80.0, 0.0, 32.0, {tx}, 0.0, 80.0, 24.0, 0.0, 0.0, 0.0, 1.0, 0.0]
"""


def write_calibration(path: Path, baseline_mm: float = 60.0, width: int = WIDTH) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    tx = -80.0 * baseline_mm / 1000
    path.write_text(CAMERA_INFO.format(height=HEIGHT, width=width, tx=tx))
    return path


def write_image(path: Path, seed: int, shape: tuple[int, ...] = (HEIGHT, WIDTH, 3)) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    noise = np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)
    assert cv2.imwrite(str(path), noise)
    return path


def write_pairs(folder: Path, stems: Iterable[str], suffix: str = ".png") -> Path:
    """`stems` as `2026-05-21/17_1`; every picture is another one."""
    for number, stem in enumerate(stems):
        for eye, side in enumerate(("left", "right")):
            shape = (HEIGHT, WIDTH) if suffix == ".pgm" else (HEIGHT, WIDTH, 3)
            write_image(folder / f"{stem}_{side}{suffix}", 2 * number + eye + 1000, shape)
    write_calibration(folder / "calibration.yml")
    return folder


class Encoding:
    """Reads in this process, and hands over what the analysis process would."""

    def __init__(self, direct: DirectAnalyst) -> None:
        self._direct = direct

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> EncodedReading:
        return encoded(self._direct.analyse(saved, expectation))


QUESTION = "3 fruitlets, last visit 4: fallen, or hidden by a leaf?"


@dataclass
class FakeAnalyst:
    """Finds three fruitlets and the tag that was expected."""

    asked: list[tuple[SavedCapture, Expectation]] = field(default_factory=list)
    status: Status = Status.ACCEPT
    error: FieldcamError | None = None

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> EncodedReading:
        self.asked.append((saved, expectation))
        if self.error is not None:
            raise self.error
        assert expectation.tag_id is not None
        fruitlets = [made_fruitlet(n, (100.0, 100.0), 9.0) for n in range(3)]
        tag = replace(TAG, id=expectation.tag_id)
        blurred = Reason(ReasonCode.BLURRED, "The picture is blurred.")
        fewer = Reason(ReasonCode.FEWER_THAN_BEFORE, QUESTION)
        reasons = {Status.RETAKE: (blurred,), Status.CONFIRM: (fewer,)}.get(self.status, ())
        reading = made_reading(fruitlets, Verdict(self.status, reasons), tag, expectation)
        return encoded(reading)


class Analyst(Protocol):
    """Reads a picture while one waits."""

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> EncodedReading: ...


@dataclass(frozen=True)
class AtOnce:
    """Has a picture read by the time it is submitted."""

    analyst: Analyst

    def submit(
        self,
        saved: SavedCapture,
        expectation: Expectation,
        *,
        urgent: bool = False,
        again: bool = False,
    ) -> Future[EncodedReading]:
        future: Future[EncodedReading] = Future()
        try:
            future.set_result(self.analyst.analyse(saved, expectation))
        except FieldcamError as error:
            future.set_exception(error)
        return future
