"""What a calibration is written as is read back the same, by this project and by OpenCV."""

from __future__ import annotations

import os
from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st
from recorded_pairs import write_calibration
from rendered_boards import Head, random_head

from fieldcam.calibration.reading.readers import load_camera, load_rectified, load_stereo_rig
from fieldcam.calibration.reading.sources import WHOLE, open_documents
from fieldcam.calibration.rectifying import rectified_rig
from fieldcam.calibration.rig import EyeLens, StereoRig
from fieldcam.calibration.solving import Lens, RawStereo
from fieldcam.calibration.written import calibration_files
from fieldcam.disk.durable import write_folder_durably
from fieldcam.errors import StorageError
from fieldcam.store.calibrations import calibration_in_use, next_calibration
from fieldcam.values import Calibration


def camera_of(head: Head) -> RawStereo:
    """As if it had been solved exactly."""
    lenses = [
        Lens(
            np.array([(lens.fx, 0, lens.cx), (0, lens.fy, lens.cy), (0, 0, 1)]),
            np.array(lens.distortion),
            0.5,
        )
        for lens in (head.left, head.right)
    ]
    return RawStereo(lenses[0], lenses[1], head.rotation, head.translation_mm, head.size_px)


def write(folder: Path, seed: int) -> StereoRig:
    camera = camera_of(random_head(np.random.default_rng(seed)))
    rig = rectified_rig(camera)
    for name, content in calibration_files(camera, rig).items():
        (folder / name).write_bytes(content)
    return rig


def assert_same_eye(found: EyeLens, expected: EyeLens) -> None:
    assert np.allclose(found.camera_matrix, expected.camera_matrix, rtol=1e-12)
    assert np.allclose(found.distortion, expected.distortion, rtol=1e-12)
    assert np.allclose(found.rotation, expected.rotation, atol=1e-12)
    assert np.allclose(found.projection, expected.projection, rtol=1e-12)


def assert_same_camera(found: Calibration, expected: Calibration) -> None:
    assert (found.width_px, found.height_px) == (expected.width_px, expected.height_px)
    for name in ("focal_px", "cx_px", "cy_px", "baseline_mm"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=1e-9), name


SERIAL = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=32)


@settings(max_examples=40)
@given(left=SERIAL, right=SERIAL)
@example(left="0", right="'")
@example(left='"', right="\\")
def test_the_heads_serial_numbers_are_read_back(
    tmp_path_factory: pytest.TempPathFactory, left: str, right: str
) -> None:
    camera = camera_of(random_head(np.random.default_rng(1)))
    path = tmp_path_factory.mktemp("calibration") / "calibration.yml"
    files = calibration_files(camera, rectified_rig(camera), (left, right))
    path.write_bytes(files["calibration.yml"])
    assert open_documents(path)[WHOLE].serials() == (left, right)
    assert isinstance(load_camera(path), StereoRig)
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert storage.getNode("right_serial").string() == right
    assert storage.getNode("P2").mat().shape == (3, 4)


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000))
def test_every_layout_is_read_back_the_same(
    tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    folder = tmp_path_factory.mktemp("calibration")
    written = write(folder, seed)
    assert_same_camera(load_rectified(folder / "right.yml"), written.rectified)
    rigs = [load_stereo_rig(folder), load_camera(folder / "calibration.yml")]
    (folder / "intrinsics.yml").unlink()
    rigs.append(load_stereo_rig(folder))  # now left.yml and right.yml speak
    for rig in rigs:
        assert isinstance(rig, StereoRig)
        assert_same_camera(rig.rectified, written.rectified)
        assert_same_eye(rig.left, written.left)
        assert_same_eye(rig.right, written.right)


def test_opencv_reads_its_own_layout(tmp_path: Path) -> None:
    rig = write(tmp_path, 1)
    storage = cv2.FileStorage(str(tmp_path / "extrinsics.yml"), cv2.FILE_STORAGE_READ)
    translation_m = storage.getNode("T").mat()
    assert np.linalg.norm(translation_m) * 1000 == pytest.approx(rig.rectified.baseline_mm)
    assert storage.getNode("P2").mat()[0, 3] < 0


def test_the_right_eye_holds_the_baseline_in_metres(tmp_path: Path) -> None:
    rig = write(tmp_path, 1)
    left, right = (
        yaml.safe_load((tmp_path / f"{eye}.yml").read_text()) for eye in ("left", "right")
    )
    assert left["P"][3] == 0
    assert -right["P"][3] / right["P"][0] * 1000 == pytest.approx(rig.rectified.baseline_mm)
    assert (left["width"], left["height"]) == rig.size_px


def test_a_folder_is_whole_or_absent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "deep" / "calibration"
    files = {"left.yml": b"left", "right.yml": b"right"}
    synced: list[int] = []
    real_fsync = os.fsync

    def fails_at_the_second(descriptor: int) -> None:
        synced.append(descriptor)
        if len(synced) == 4:  # two folders are made and one file written before
            raise OSError(28, "No space left on device")
        real_fsync(descriptor)

    monkeypatch.setattr(os, "fsync", fails_at_the_second)
    with pytest.raises(StorageError, match="No room"):
        write_folder_durably(target, files)
    monkeypatch.undo()
    assert list(target.parent.iterdir()) == []
    write_folder_durably(target, files)
    assert {path.name: path.read_bytes() for path in target.iterdir()} == files
    with pytest.raises(StorageError):
        write_folder_durably(target, {"left.yml": b"another"})
    assert (target / "left.yml").read_bytes() == b"left"


def test_the_highest_number_is_in_use_whatever_the_clock_said(tmp_path: Path) -> None:
    assert calibration_in_use(tmp_path) is None
    for number, day in ((1, "2026-05-01"), (2, "2026-05-09"), (10, "2019-01-01")):
        write_calibration(tmp_path / "calibrations" / f"{number:04d}-{day}" / "calibration.yml")
    (tmp_path / "calibrations" / "0010-2026-05-11").mkdir()
    (tmp_path / "calibrations" / ".0011-2026-05-10.abc.part").mkdir()
    (tmp_path / "calibrations" / "notes").mkdir()
    newest = tmp_path / "calibrations" / "0010-2019-01-01"
    assert calibration_in_use(tmp_path) == newest / "calibration.yml"
    assert next_calibration(tmp_path, date(2026, 5, 10)).name.startswith("0011-")
