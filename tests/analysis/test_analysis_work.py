"""The analysis process reads what was saved, as the calling process would."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_readings import CAMERA, made_reading

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.supervisor import Supervisor
from fieldcam.analysis.work import DirectAnalyst, VisionWork
from fieldcam.cli import self_test
from fieldcam.codec.readings import dump_reading
from fieldcam.errors import CalibrationInvalid
from fieldcam.models import find_models
from fieldcam.store.captures import SavedCapture
from fieldcam.store.folder import DataKind
from fieldcam.store.store import open_store
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Expectation,
    PixelFormat,
    RawPair,
    Settings,
    StereoPair,
)
from fieldcam.vision.pipeline import Pipeline


def save(folder: Path, pair: StereoPair) -> SavedCapture:
    taken_at = datetime(2026, 5, 21, tzinfo=UTC)
    raw = RawPair(pair.left, pair.right, PixelFormat.RGB8, taken_at, 0, 0, "L", "R", 1)
    with open_store(folder, DataKind.FIELD) as store:
        return store.save(raw)


class FakePipeline:
    """Remembers the last pair and its camera."""

    def __init__(self) -> None:
        self.seen: list[tuple[StereoPair, Calibration]] = []

    def analyse(
        self,
        pair: StereoPair,
        calibration: Calibration,
        expectation: Expectation | None = None,
        settings: Settings | None = None,
    ) -> ClusterReading:
        self.seen.append((pair, calibration))
        return made_reading(expectation=expectation)


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch) -> FakePipeline:
    fake = FakePipeline()
    monkeypatch.setattr(Pipeline, "from_models", lambda models: fake)
    return fake


def test_the_warm_up_costs_less_than_a_pair(pipeline: FakePipeline) -> None:
    VisionWork(Setup(CAMERA)).warm_up()
    ((pair, camera),) = pipeline.seen
    assert pair.size_px == (camera.width_px, camera.height_px) == (320, 240)


def test_a_folder_as_camera_rectifies(tmp_path: Path, pipeline: FakePipeline) -> None:
    camera = {"image_width": 64, "image_height": 48, "distortion_model": "plumb_bob"}
    matrix = [80.0, 0, 32, 0, 80, 24, 0, 0, 1]
    for name, shift in (("left", 0.0), ("right", -4.8)):
        eye: dict[str, Any] = {
            **camera, "K": matrix, "D": [0.0] * 5, "R": [1, 0, 0, 0, 1, 0, 0, 0, 1],
            "P": [80.0, 0, 32, shift, 0, 80, 24, 0, 0, 0, 1, 0],
        }  # fmt: skip
        (tmp_path / f"{name}.yml").write_text(json.dumps(eye))
    image = np.full((48, 64, 3), 90, np.uint8)
    saved = save(tmp_path / "data", StereoPair(image, image))
    reading = VisionWork(Setup(tmp_path)).analyse(saved, Expectation(17))
    assert reading.expectation == Expectation(17)
    ((pair, rectified),) = pipeline.seen
    assert rectified.baseline_mm == pytest.approx(60)
    np.testing.assert_array_equal(pair.left, image)


def test_a_calibration_that_is_none_is_said_at_the_warm_up(
    tmp_path: Path, pipeline: FakePipeline
) -> None:
    with pytest.raises(CalibrationInvalid):
        VisionWork(Setup(tmp_path)).warm_up()


@pytest.mark.slow
def test_a_process_of_its_own_reads_the_same(tmp_path: Path) -> None:
    saved = save(tmp_path, self_test.drawn_pair())
    expectation = Expectation(self_test.TAG_ID, 3)
    pipeline = Pipeline.from_models(find_models())
    direct = DirectAnalyst(pipeline, self_test.CAMERA, Settings()).analyse(saved, expectation)
    with Supervisor(Setup(self_test.CAMERA), tmp_path / "analysis.log") as supervisor:
        apart = supervisor.submit(saved, expectation).result()
    assert dump_reading(replace(apart.decode(), timing_ms={})) == dump_reading(
        replace(direct, timing_ms={})
    )
