"""Pictures of a camera that is known beforehand keep its calibration, as those of a head do."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_readings import CAMERA
from stored_walks import MadeWalk, small_store

from fieldcam.calibration.reading.readers import load_camera
from fieldcam.calibration.rectified_file import rectified_file
from fieldcam.session.calibrating import keep_known
from fieldcam.values import Calibration


def test_the_file_says_what_the_camera_is(tmp_path: Path) -> None:
    file = tmp_path / "calibration.yml"
    file.write_bytes(rectified_file(CAMERA))
    found = load_camera(file)
    assert isinstance(found, Calibration)
    assert found.baseline_mm == pytest.approx(CAMERA.baseline_mm)
    assert (found.focal_px, found.cx_px, found.cy_px) == (
        CAMERA.focal_px,
        CAMERA.cx_px,
        CAMERA.cy_px,
    )


def test_it_goes_with_each_picture(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        known = keep_known(store, CAMERA)
        assert known is not None and known.problem == "" and known.doubt(("L", "R")) == ""
        walk = MadeWalk(store)
        completed = known.completed(walk.take(walk.visit(), 11))
        assert completed.calibration == store.objects.path(known.name)
        assert known.completed(completed) is completed
        assert keep_known(store, CAMERA) == known
        assert keep_known(store, known.file) == known
        assert keep_known(store, tmp_path) is None
        assert keep_known(store, None) is None
