"""A recorded folder comes out of the camera's port pair by pair."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fieldcam.camera.replay import ReplayCamera
from fieldcam.errors import CameraUnplugged, ImageUnreadable
from fieldcam.exchange.capture_folder import read_capture_folder
from fieldcam.exchange.images import write_png


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    day = tmp_path / "2026-05-21"
    day.mkdir()
    for tag, level in ((8, 10), (9, 60)):
        for eye, extra in (("left", 0), ("right", 5)):
            write_png(day / f"{tag}_1_{eye}.png", np.full((4, 6, 3), level + extra, np.uint8))
    return tmp_path


def test_pairs_come_in_their_order_and_then_no_more(recording: Path) -> None:
    captures = read_capture_folder(recording).captures
    with ReplayCamera(captures, None) as camera:
        first, second = camera.capture(1), camera.capture(1)
        assert [first.left[0, 0, 0], first.right[0, 0, 0]] == [10, 15]
        assert [second.left[0, 0, 0], second.right[0, 0, 0]] == [60, 65]
        assert [first.trigger_ordinal, second.trigger_ordinal] == [1, 2]
        assert not first.simulated
        with pytest.raises(CameraUnplugged):
            camera.capture(1)


def test_a_closed_camera_takes_no_more_pictures(recording: Path) -> None:
    camera = ReplayCamera(read_capture_folder(recording).captures, None)
    camera.close()
    camera.close()
    with pytest.raises(CameraUnplugged):
        camera.capture(1)


def test_a_pair_that_vanished_is_said_so(recording: Path) -> None:
    captures = read_capture_folder(recording).captures
    captures[0].right.unlink()
    with ReplayCamera(captures, None) as camera, pytest.raises(ImageUnreadable):
        camera.capture(1)
