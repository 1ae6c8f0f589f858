"""The live walk over the emulated head: pictures, its button, a pulled plug, its calibration."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from called_commands import CAMERA_INFO
from emulated_head import DISPARITY, HEIGHT, QUICK, WIDTH, Bench
from live_walks import Heard, ToldAnalysis, read
from stored_walks import MadeWalk, small_store

from fieldcam.session import shutter
from fieldcam.session.calibrating import MISSING, OwnCalibration
from fieldcam.session.commands import Accept, RestartAnalysis, Shoot
from fieldcam.session.events import CameraReady, CameraTrouble, Changed, Saved, VerdictReady
from fieldcam.session.live import LiveWalk
from fieldcam.store.calibrations import next_calibration
from fieldcam.store.captures import load_raw
from fieldcam.store.connection import rows
from fieldcam.store.rows.walk import ObjectRole
from fieldcam.store.store import Store

CALIBRATION = CAMERA_INFO.format(width=WIDTH, height=HEIGHT, tx=-45.6)


class HeadWalk:
    """A live walk with the emulated head, and an analysis that does as told."""

    def __init__(self, store: Store, bench: Bench) -> None:
        made = MadeWalk(store)
        self.store, self.bench = store, bench
        self.heard, self.analysis = Heard(), ToldAnalysis()
        self.calibration = OwnCalibration(store)
        self.live = LiveWalk(
            store,
            made.visit(),
            bench.finder.open,
            lambda changed: self.analysis,
            self.heard,
            calibration=self.calibration,
        )

    def calibrate(self, content: str = CALIBRATION) -> None:
        folder = next_calibration(self.bench.folder, date(2026, 5, 21))
        folder.mkdir(parents=True)
        (folder / "calibration.yml").write_text(content)

    def shoot(self) -> Saved:
        self.live.do(Shoot())
        return self.heard.next(Saved)


@pytest.fixture
def walk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[HeadWalk]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(shutter, "REOPEN_EVERY_S", 0.05)
    with small_store(tmp_path) as store:
        bench = Bench(store.folder.path)
        bench.write(QUICK + 'shutter_line = "Line0"\n')
        found = HeadWalk(store, bench)
        yield found
        found.live.close()
        assert bench.backend.open_handles == 0


def test_pictures_of_the_head_are_saved_with_its_calibration_and_read(walk: HeadWalk) -> None:
    walk.calibrate()
    walk.analysis.outcomes += [read(11), read(12)]
    for ordinal in (1, 2):
        saved = walk.shoot().capture
        raw = load_raw(saved)
        assert np.array_equal(raw.left[:, DISPARITY:], raw.right[:, :-DISPARITY])
        assert raw.trigger_ordinal == ordinal
        assert saved.calibration is not None and saved.calibration.read_text() == CALIBRATION
        walk.heard.next(VerdictReady)
        walk.live.do(Accept())
    roles = rows(walk.store.database, "SELECT file, role FROM object_file")
    assert [row["role"] for row in roles] == [ObjectRole.CALIBRATION]


def test_without_a_calibration_pictures_wait_and_are_read_with_the_first(walk: HeadWalk) -> None:
    assert MISSING in walk.heard.next(CameraReady).notes
    saved = walk.shoot().capture
    assert saved.calibration is None
    state = walk.heard.next(Changed).state
    assert (state.uncalibrated, state.waiting) == (MISSING, 1)
    # Of the calibration is told as long as it is missing, of the camera until it is opened anew.
    (note,) = state.camera_notes
    assert "is taken for the left camera" in note
    assert walk.analysis.asked == []
    walk.calibrate("nothing: 1\n")
    assert walk.shoot().capture.calibration is None
    assert walk.heard.next(Changed).state.uncalibrated.startswith("Pictures are saved and wait: ")
    walk.calibrate()
    walk.analysis.outcomes += [read(11), read(11)]
    walk.live.do(RestartAnalysis())
    walk.heard.next(VerdictReady)
    walk.heard.next(VerdictReady)
    assert {asked.calibration for asked, _ in walk.analysis.asked} == {walk.calibration.file}


def test_a_pulled_plug_costs_one_picture_and_no_walk(walk: HeadWalk) -> None:
    walk.calibrate()
    walk.shoot()
    walk.bench.emulated.unplug()
    walk.live.do(Shoot())
    assert walk.heard.next(CameraTrouble).error.message == "The camera is gone."
    walk.bench.emulated.plug()
    assert walk.heard.next(CameraReady).missed == "The camera is gone."
    assert walk.shoot().capture.calibration is not None


def test_a_head_that_nobody_uses_is_missed_and_found_again(
    walk: HeadWalk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutter, "ATTEND_EVERY_S", 0.05)
    for _ in range(2):
        walk.shoot()
        walk.bench.emulated.unplug()
        assert walk.heard.next(CameraTrouble).error.message == "The camera is gone."
        walk.bench.emulated.plug()
        assert not walk.heard.next(CameraReady).missed


def test_the_heads_button_takes_a_picture(walk: HeadWalk) -> None:
    walk.heard.next(CameraReady)
    walk.bench.cameras[0].press_shutter()
    assert walk.heard.next(Saved).tag_id == 11


def test_a_new_calibration_goes_with_the_next_picture_only(walk: HeadWalk) -> None:
    walk.calibrate()
    first = walk.shoot().capture.calibration
    walk.calibrate(CALIBRATION.replace("-45.6", "-45.7"))
    second = walk.shoot().capture.calibration
    assert None not in (first, second) and first != second
