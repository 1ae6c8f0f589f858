"""Every picture is kept with the calibration of the camera that took it."""

from __future__ import annotations

from pathlib import Path

import pytest
from live_walks import ToldAnalysis, Walked, read, walked
from recorded_pairs import write_calibration

from fieldcam.analysis.requests import Setup
from fieldcam.errors import CalibrationInvalid
from fieldcam.session.events import Saved
from fieldcam.store.connection import rows
from fieldcam.store.resuming import saved_capture
from fieldcam.tui import wiring


def kept_with(walk: Walked) -> bytes | None:
    """The calibration file of the next picture, as a later start finds it."""
    walk.analysis.outcomes.append(read(11))
    saved, _ = walk.after(walk.live.shoot, Saved)
    found = saved_capture(walk.store.database, saved.capture.key)
    assert found is not None and found.calibration == saved.capture.calibration
    return None if found.calibration is None else found.calibration.read_bytes()


def test_a_picture_names_the_calibration_that_was_in_use(tmp_path: Path) -> None:
    with walked(tmp_path) as walk:
        name = walk.store.keep_calibration(b"P: [1]\n")
        walk.start(name)
        assert kept_with(walk) == b"P: [1]\n"
        walk.live.close()
        walk.start(walk.store.keep_calibration(b"P: [2]\n"))
        assert kept_with(walk) == b"P: [2]\n"
        assert walk.store.keep_calibration(b"P: [1]\n") == name
        files = rows(walk.store.database, "SELECT file FROM object_file")
        assert len(files) == 2


def test_a_picture_without_a_calibration_names_none(tmp_path: Path) -> None:
    with walked(tmp_path) as walk:
        walk.start()
        assert kept_with(walk) is None


def test_the_app_keeps_the_file_that_describes_its_camera(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    analysis = ToldAnalysis()
    monkeypatch.setattr(wiring, "Supervisor", lambda *given: analysis)
    path = write_calibration(tmp_path / "calibration.yml")
    with walked(tmp_path / "data") as walk:
        rig = wiring.Rig(walk.camera.open, Setup(path))
        walk.live, walk.analysis = rig.walk(walk.store, walk.visit, walk.heard), analysis
        content = path.read_bytes()
        path.unlink()
        assert kept_with(walk) == content
        with pytest.raises(CalibrationInvalid, match="cannot be read"):
            rig.walk(walk.store, walk.visit, walk.heard)
