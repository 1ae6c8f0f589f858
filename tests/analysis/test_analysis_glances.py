"""Previews are looked at between pairs, and cost none of them anything."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from drawn_tags import IMAGE_CORNERS, draw_tag
from made_readings import CAMERA
from watched_analysis import LONG_S, Watch, pair

from fieldcam.analysis.messages import (
    FindTags,
    Frames,
    MessageInvalid,
    Setup,
    decode_reply,
    encode_reply,
    frame,
)
from fieldcam.analysis.process import Wakeup
from fieldcam.analysis.queue import PreviewJob, WorkQueue
from fieldcam.analysis.status import AnalysisState, AnalysisStatus
from fieldcam.analysis.work import VisionWork
from fieldcam.disk.raw_images import encode_raw
from fieldcam.errors import AnalysisFailed, AnalysisOff, ImageUnreadable
from fieldcam.values import Calibration, Expectation
from fieldcam.vision.tags.detection import detect_tags

RANGE_MM = 440.0


def test_a_preview_is_looked_at_before_the_pairs_that_wait(watch: Watch, gate: Path) -> None:
    watched = watch("Waiting", data=gate)
    order: list[str] = []
    future = watched.submit(pair("nothing"), Expectation())
    future.add_done_callback(lambda _: order.append("pair"))
    glance = watched.supervisor.look(Path("nothing.pnm"), 7)
    glance.add_done_callback(lambda _: order.append("preview"))
    gate.write_bytes(b"go")
    future.result(LONG_S)
    assert [tag.id for tag in glance.result(LONG_S)] == [7]
    assert order == ["preview", "pair"]


def test_previews_leave_the_status_as_it_is(watch: Watch) -> None:
    watched = watch()
    watched.wait_for(AnalysisState.READY)
    for number in range(5):
        assert watched.supervisor.look(Path("nothing.pnm"), number).result(LONG_S)
    assert watched.heard == [AnalysisStatus(AnalysisState.READY)]


def test_a_preview_that_ends_the_process_costs_no_pair(watch: Watch) -> None:
    watched = watch()
    error = watched.supervisor.look(Path("segfault.pnm"), 1).exception(LONG_S)
    assert type(error) is AnalysisFailed
    assert watched.reads()
    assert watched.settled().restarts == 1


def test_a_preview_that_cannot_be_read_is_said(watch: Watch) -> None:
    watched = watch()
    error = watched.supervisor.look(Path("refuse.pnm"), 1).exception(LONG_S)
    assert isinstance(error, ImageUnreadable)
    assert watched.reads()


def test_a_closed_analysis_looks_at_nothing(watch: Watch) -> None:
    watched = watch()
    watched.supervisor.close()
    error = watched.supervisor.look(Path("nothing.pnm"), 1).exception(LONG_S)
    assert isinstance(error, AnalysisOff)


def test_a_newer_preview_takes_the_place_of_the_one_that_waits() -> None:
    queue = WorkQueue(Wakeup(), lambda status: None, tries=2)
    first, second, third, fourth = (PreviewJob(FindTags(Path("p"), n)) for n in range(4))
    queue.look(first)
    queue.look(second)
    assert first.future.cancelled()
    assert queue.take_preview() is second
    assert queue.take_preview() is None
    queue.look(third)
    queue.shut(AnalysisOff("The analysis is off."))
    assert isinstance(third.future.exception(0), AnalysisOff)
    queue.open()
    queue.look(fourth)
    assert not fourth.future.done()


@pytest.fixture
def preview(tmp_path: Path) -> Path:
    """Tag 17 in a picture a third of the size of CAMERA's, 440 mm away."""
    side_px = 27.95 * CAMERA.focal_px / RANGE_MM / 3
    middle = np.array([CAMERA.cx_px / 3, CAMERA.cy_px / 3])
    corners = IMAGE_CORNERS * side_px / 2 + middle
    path = tmp_path / "preview.pnm"
    path.write_bytes(encode_raw(draw_tag(corners, (CAMERA.width_px // 3, CAMERA.height_px // 3))))
    return path


def test_a_shrunk_picture_gives_the_whole_cameras_range(preview: Path) -> None:
    (tag,) = VisionWork(Setup(CAMERA)).look(preview, 3)
    assert tag.id == 17
    assert tag.range_mm == pytest.approx(RANGE_MM, rel=0.02)
    assert tag.translation_mm is not None
    assert tag.translation_mm[:2] == pytest.approx((0, 0), abs=1)


def test_a_file_may_describe_the_camera(preview: Path, tmp_path: Path) -> None:
    path = tmp_path / "calibration.yml"
    path.write_text(
        "image_width: 640\nimage_height: 480\n"
        "P: [760.0, 0, 320.0, -45.6, 0, 760.0, 240.0, 0, 0, 0, 1, 0]\n"
    )
    work = VisionWork(Setup(path))
    (tag,) = work.look(preview, 3)
    assert tag.range_mm == pytest.approx(RANGE_MM, rel=0.02)


def test_a_previews_own_calibration_goes_first(preview: Path, tmp_path: Path) -> None:
    """The app's analysis may have been started before the camera was calibrated."""
    path = tmp_path / "calibration.yml"
    path.write_text(
        "image_width: 640\nimage_height: 480\n"
        "P: [1520.0, 0, 320.0, -91.2, 0, 1520.0, 240.0, 0, 0, 0, 1, 0]\n"
    )
    for camera in (None, CAMERA):
        (tag,) = VisionWork(Setup(camera)).look(preview, 3, path)
        assert tag.range_mm == pytest.approx(2 * RANGE_MM, rel=0.02)


def test_without_a_camera_the_tag_is_read_all_the_same(preview: Path) -> None:
    (tag,) = VisionWork(Setup(None)).look(preview, 3)
    assert (tag.id, tag.range_mm) == (17, None)


def test_a_preview_that_is_gone_is_said(tmp_path: Path) -> None:
    with pytest.raises(ImageUnreadable):
        VisionWork(Setup(CAMERA)).look(tmp_path / "gone.pnm", 3)


@pytest.mark.parametrize("camera", [CAMERA, None])
def test_tags_arrive_as_they_were_seen(camera: Calibration | None) -> None:
    corners = IMAGE_CORNERS * 20 + 60
    tags = detect_tags(draw_tag(corners, (120, 120)), camera)
    (document,) = Frames().feed(frame(encode_reply(tags)))
    assert tags and decode_reply(document) == tags


@pytest.mark.parametrize("tags", [None, 1, [1], [{}], [{"id": 1, "center_px": [1]}]])
def test_tags_that_are_none_are_refused(tags: object) -> None:
    with pytest.raises(MessageInvalid):
        decode_reply(json.dumps({"is": "tags", "tags": tags}).encode())
