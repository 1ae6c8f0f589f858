"""Previews while somebody aims, a camera that is found again, and its own shutter."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_walks import ToldAnalysis, Walked, read, walked
from made_cues import tag

from fieldcam.camera.preview import Preview
from fieldcam.disk.raw_images import decode_raw
from fieldcam.errors import AnalysisOff, CameraUnplugged, CaptureTimeout, FieldcamError
from fieldcam.session import shutter
from fieldcam.session.aim.aiming import Aiming
from fieldcam.session.aim.preview_file import CUE_NAME, IMAGE_NAME, PreviewFile, preview_folder
from fieldcam.session.commands import Shoot, StartPreview, StopPreview
from fieldcam.session.events import CameraReady, CameraTrouble, LiveEvent, Previewed, Saved
from fieldcam.session.state import CameraState
from fieldcam.store.queries.history import visit_captures

PREVIEW = Preview(np.full((6, 8), 9, np.uint8), 3, flash_ready=True)


@pytest.fixture
def walk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Walked]:
    """At tag 11; all waiting is short."""
    monkeypatch.setattr(shutter, "PREVIEW_EVERY_S", 0.01)
    monkeypatch.setattr(shutter, "REOPEN_EVERY_S", 0.01)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    with walked(tmp_path / "data") as found:
        found.analysis.sights = [(tag(11),)]
        yield found


def test_the_camera_is_looked_through_only_while_somebody_aims(walk: Walked) -> None:
    walk.start()
    assert walk.camera.looks == 0
    walk.live.do(StartPreview())
    first, second = (walk.heard.next(Previewed) for _ in range(2))
    assert (first.cue.due, first.cue.read, first.cue.still) == (11, (11,), None)
    assert second.cue.ready
    assert second.picture.shape == (6, 8)
    walk.live.do(StopPreview())
    walk.shoot()
    looks = walk.camera.looks
    walk.shoot()
    assert walk.camera.looks == looks


def test_of_two_tags_in_view_the_due_one_counts(walk: Walked) -> None:
    """The neighbour's tag is nearer, and comes and goes."""
    walk.analysis.sights = [(tag(12, 300.0), tag(11)), (tag(12, 300.0),), (tag(11), tag(12))]
    walk.start()
    walk.live.do(StartPreview())
    first, second, third = (walk.heard.next(Previewed).cue for _ in range(3))
    assert (first.due, first.read, first.range_mm) == (11, (11, 12), 440.0)
    assert not second.in_view and second.range_mm is None
    assert third.in_view and third.moved_mm is None
    state = walk.shoot(read(11))
    assert state.shown is not None and state.shown.record.tag_id == 11
    assert walk.analysis.asked[-1][1].tag_id == 11
    assert state.warnings == ()


def test_a_tag_that_hangs_twice_in_view_is_never_ready(walk: Walked) -> None:
    walk.analysis.sights = [(tag(11), tag(11, 460.0))]
    walk.start()
    walk.live.do(StartPreview())
    cues = [walk.heard.next(Previewed).cue for _ in range(3)]
    assert not any(cue.in_view or cue.ready for cue in cues)


def test_previews_go_on_after_a_picture(walk: Walked) -> None:
    walk.start()
    walk.live.do(StartPreview())
    walk.shoot(read(11))
    assert walk.heard.next(Previewed).cue.read == (11,)


def test_a_camera_that_sees_nothing_yet_is_asked_again(walk: Walked) -> None:
    walk.camera.sight = None
    walk.start()
    walk.live.do(StartPreview())
    while walk.camera.looks < 3:
        pass
    walk.camera.sight = PREVIEW
    assert walk.heard.next(Previewed).cue.read == (11,)


def test_a_camera_that_is_plugged_in_again_is_found(walk: Walked) -> None:
    walk.start()
    walk.live.do(StartPreview())
    walk.heard.next(Previewed)
    walk.camera.plugged = False
    trouble = walk.heard.next(CameraTrouble)
    assert trouble.error.hint == "Plug it in."
    walk.heard.until(lambda state: state.camera is CameraState.LOST)
    walk.camera.plugged = True
    walk.heard.next(CameraReady)
    walk.heard.until(lambda state: state.camera is CameraState.READY)
    assert walk.heard.next(Previewed).cue.read == (11,)
    assert walk.shoot(read(11)).shown is not None


def test_a_camera_that_was_never_there_is_found_without_a_key(walk: Walked) -> None:
    walk.camera.plugged = False
    if walk.start().camera is not CameraState.LOST:
        walk.heard.until(lambda state: state.camera is CameraState.LOST)
    walk.camera.plugged = True
    walk.heard.until(lambda state: state.camera is CameraState.READY)
    assert sum(isinstance(event, CameraTrouble) for event in walk.heard.events) == 1


def test_the_same_trouble_is_said_once(walk: Walked, monkeypatch: pytest.MonkeyPatch) -> None:
    """A camera that opens, and then fails whenever it is looked through."""
    walk.start()

    def fail(deadline_s: float) -> Preview | None:
        walk.camera.looks += 1
        raise CaptureTimeout("The camera gave no preview.")

    monkeypatch.setattr(walk.camera, "preview", fail)
    walk.live.do(StartPreview())
    while walk.camera.looks < 4:
        pass
    walk.shoot()
    assert sum(isinstance(event, CameraTrouble) for event in walk.heard.events) == 1


TROUBLES: dict[str, FieldcamError] = {
    "unplugged": CameraUnplugged("The camera is unplugged.", "Check its cable."),
    "slow": CaptureTimeout("The camera gave no pair within 5 s.", "Take it again."),
}


@pytest.mark.parametrize("name", TROUBLES)
def test_trouble_in_the_middle_of_a_picture_loses_nothing(
    walk: Walked, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    walk.start()
    walk.shoot(read(11))

    def fail(deadline_s: float) -> Any:  # noqa: ANN401 (it gives nothing)
        raise TROUBLES[name]

    with monkeypatch.context() as patch:
        patch.setattr(walk.camera, "capture", fail)
        walk.live.do(Shoot())
        assert walk.heard.next(CameraTrouble).error is TROUBLES[name]
    assert walk.heard.next(CameraReady).missed
    state = walk.heard.until(lambda state: state.camera is CameraState.READY)
    assert state.shown is not None and state.shown.living == 5
    walk.shoot(read(11))
    assert len(visit_captures(walk.store.database, walk.visit)) == 2


def test_the_cameras_own_shutter_takes_the_picture(walk: Walked) -> None:
    walk.start()
    saved, _ = walk.after(walk.camera.press, Saved)
    assert saved.tag_id == 11


def test_the_preview_lies_beside_its_cue_while_somebody_aims(walk: Walked, tmp_path: Path) -> None:
    folder = preview_folder(walk.store.folder.path)
    assert folder.is_relative_to(tmp_path / "run")
    walk.start()
    walk.live.do(StartPreview())
    walk.heard.next(Previewed)
    walk.heard.next(Previewed)
    image = decode_raw((folder / IMAGE_NAME).read_bytes(), IMAGE_NAME)
    np.testing.assert_array_equal(image, PREVIEW.left)
    cue = json.loads((folder / CUE_NAME).read_text())
    assert cue.pop("at").endswith("+00:00")
    assert cue == {
        "due": 11,
        "place_mm": [0.0, 50.0, 440.0],
        "read": [11],
        "range_mm": 440.0,
        "zone": "good",
        "moved_mm": 0.0,
        "still": True,
        "flash_ready": True,
        "ready": True,
        "problem": "",
    }
    walk.live.close()
    assert not list(folder.iterdir())


def test_without_a_runtime_folder_the_data_folder_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for configured in ("", "relative"):
        monkeypatch.setenv("XDG_RUNTIME_DIR", configured)
        assert preview_folder(tmp_path) == tmp_path / "runtime"
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/1000")
    assert preview_folder(tmp_path / "a") != preview_folder(tmp_path / "b")


class Aimed:
    """Aiming at tag 11, and what it told."""

    def __init__(self, folder: Path) -> None:
        self.analysis, self.told = ToldAnalysis(), list[Previewed]()
        self.aiming = Aiming(PreviewFile(folder), self.analysis, self._hear)
        self.aiming.due = 11

    def _hear(self, event: LiveEvent) -> None:
        assert isinstance(event, Previewed)
        self.told.append(event)


@pytest.fixture
def aimed(tmp_path: Path) -> Aimed:
    return Aimed(tmp_path / "run")


def test_a_busy_analysis_does_not_hold_up_the_picture(aimed: Aimed) -> None:
    for _ in range(3):
        aimed.aiming.show(PREVIEW)
    assert [told.cue.problem for told in aimed.told] == ["The analysis is busy."] * 2
    aimed.analysis.glances[0].set_result((tag(11),))
    assert aimed.told[-1].cue.read == (11,)
    assert len(aimed.analysis.looked) == 1


FAILURES: dict[str, Callable[[Future[Any]], object]] = {
    "The analysis is off. Start it.": lambda glance: glance.set_exception(
        AnalysisOff("The analysis is off.", "Start it.")
    ),
    "": lambda glance: glance.cancel(),
}


@pytest.mark.parametrize("problem", FAILURES)
def test_a_look_that_fails_leaves_the_picture(aimed: Aimed, problem: str) -> None:
    aimed.aiming.show(PREVIEW)
    FAILURES[problem](aimed.analysis.glances[0])
    assert aimed.told[-1].cue.problem.startswith(problem) and aimed.told[-1].cue.problem
    assert not aimed.told[-1].cue.ready


def test_a_folder_that_cannot_be_written_leaves_the_picture(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    aimed = Aimed(tmp_path / "file" / "run")
    aimed.aiming.show(PREVIEW)
    assert "cannot be written" in aimed.told[0].cue.problem


def test_a_late_look_leaves_no_files(aimed: Aimed, tmp_path: Path) -> None:
    aimed.aiming.show(PREVIEW)
    aimed.aiming.stop()
    aimed.analysis.glances[0].set_result((tag(11),))
    assert not list((tmp_path / "run").iterdir())
    assert not aimed.told
