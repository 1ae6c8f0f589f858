"""Every picture is kept with the calibration of the camera that took it."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date
from errno import EACCES
from pathlib import Path

import pytest
from live_walks import Walked, read, walked
from recorded_pairs import write_calibration

from fieldcam.cli.doctor import Health, _calibration
from fieldcam.session import shutter
from fieldcam.session.calibrating import MISSING, OwnCalibration
from fieldcam.session.commands import Accept, Shoot, StartPreview
from fieldcam.session.events import CameraReady, Previewed, Saved
from fieldcam.session.state import CameraState
from fieldcam.store.calibrations import next_calibration
from fieldcam.store.connection import rows
from fieldcam.store.queries.resuming import saved_capture


def calibrate(walk: Walked, comment: str = "") -> bytes:
    """Put the data folder's next calibration into use; gives its content."""
    folder = next_calibration(walk.store.folder.path, date(2026, 5, 21))
    folder.mkdir(parents=True)
    path = write_calibration(folder / "calibration.yml")
    path.write_text(f"{path.read_text()}\n# {comment}\n")
    return path.read_bytes()


def kept_with(walk: Walked) -> bytes | None:
    """The calibration file of the next picture, as a later start finds it."""
    walk.analysis.outcomes.append(read(11))
    saved, _ = walk.after(Shoot(), Saved)
    found = saved_capture(walk.store.database, saved.capture.key)
    assert found is not None and found.calibration == saved.capture.calibration
    return None if found.calibration is None else found.calibration.read_bytes()


def test_a_picture_names_the_calibration_that_was_in_use(tmp_path: Path) -> None:
    with walked(tmp_path) as walk:
        first = calibrate(walk)
        walk.start(OwnCalibration(walk.store))
        assert kept_with(walk) == first
        second = calibrate(walk, "made while the app runs")
        walk.live.do(Accept())
        assert kept_with(walk) == second
        assert len(rows(walk.store.database, "SELECT file FROM object_file")) == 2


def test_a_picture_without_a_calibration_names_none(tmp_path: Path) -> None:
    with walked(tmp_path) as walk:
        state = walk.start(OwnCalibration(walk.store))
        assert state.uncalibrated == MISSING
        assert kept_with(walk) is None


def test_aiming_needs_no_new_start_for_a_first_calibration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutter, "PREVIEW_EVERY_S", 0.01)
    with walked(tmp_path) as walk:
        walk.analysis.sights = [()]
        own = OwnCalibration(walk.store)
        walk.start(own)
        walk.live.do(StartPreview())
        walk.heard.next(Previewed)
        assert walk.analysis.looked_with[-1] is None
        calibrate(walk)
        for _ in range(2):  # one may be on its way
            walk.heard.next(Previewed)
        assert walk.analysis.looked_with[-1] == own.file is not None


def test_calibrations_that_cannot_be_read_hold_up_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with walked(tmp_path) as walk:
        first = calibrate(walk)
        monkeypatch.setattr(Path, "iterdir", unreadable)
        state = walk.start(OwnCalibration(walk.store))
        assert "calibrations cannot be read: Permission denied." in state.uncalibrated
        walk.after(Shoot(), Saved)
        monkeypatch.undo()
        assert kept_with(walk) == first


def unreadable(path: Path) -> Iterator[Path]:
    raise PermissionError(EACCES, "Permission denied")


def test_the_doctor_and_the_app_agree_on_a_calibration(tmp_path: Path) -> None:
    """One of rectified pictures, and one that is damaged."""
    with walked(tmp_path) as walk:
        calibrate(walk)
        data = walk.store.folder.path
        (file,) = data.glob("calibrations/*/calibration.yml")
        assert OwnCalibration(walk.store).problem == ""
        checked = _calibration(data)
        assert checked.health is Health.GOOD
        assert "baseline 60.00 mm" in checked.text and "rectified already" in checked.text
        file.write_text("P: [")
        assert OwnCalibration(walk.store).problem
        assert _calibration(data).health is Health.BAD


@pytest.mark.parametrize(
    ("serials", "words"),
    [
        (("L", "R"), ""),
        (("R", "L"), "Left and right were swapped since the camera was calibrated"),
        (("L", "9"), "The calibration is of another head, L and 9"),
        (None, ""),
    ],
)
def test_a_calibration_of_another_head_is_told(
    tmp_path: Path, serials: tuple[str, str] | None, words: str
) -> None:
    with walked(tmp_path) as walk:
        calibrate(walk)
        (file,) = walk.store.folder.path.glob("calibrations/*/calibration.yml")
        if serials is not None:
            named = f'left_serial: "{serials[0]}"\nright_serial: "{serials[1]}"\n'
            file.write_text(file.read_text() + named)
        walk.start(OwnCalibration(walk.store))
        walk.heard.until(lambda state: state.camera is CameraState.READY)
        (ready,) = (event for event in walk.heard.events if isinstance(event, CameraReady))
        notes = ready.notes
        assert len(notes) == bool(words) and words in "".join(notes)
        assert kept_with(walk) == file.read_bytes()


def test_a_damaged_calibration_is_not_used_and_said(tmp_path: Path) -> None:
    with walked(tmp_path) as walk:
        calibrate(walk)
        (file,) = walk.store.folder.path.glob("calibrations/*/calibration.yml")
        file.write_text("P: [")
        own = OwnCalibration(walk.store)
        assert own.name is None
        assert own.problem.startswith(f"Pictures are saved and wait: {file}")
