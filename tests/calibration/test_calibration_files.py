"""Every calibration format is read, and impossible cameras are refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fieldcam.calibration.reading.readers import load_rectified, load_stereo_rig
from fieldcam.errors import CalibrationInvalid, FieldcamError
from fieldcam.values import Calibration

Entry = npt.NDArray[Any] | str | int
"""What a file of OpenCV's holds under one name."""

FOCAL, CX, CY, BASELINE_M = 1717.0, 705.5, 512.25, 0.0599
PROJECTION = [FOCAL, 0.0, CX, -FOCAL * BASELINE_M, 0.0, FOCAL, CY, 0.0, 0.0, 0.0, 1.0, 0.0]
LAYOUT_A: dict[str, object] = {
    "header": {"seq": 4, "stamp": {"secs": 1, "nsecs": 2}, "frame_id": "camera"},
    "height": 1080,
    "width": 1440,
    "distortion_model": "plumb_bob",
    "D": [-0.28, 0.18, 0.002, 0.0008, 0.0],
    "K": [1740.0, 0.0, 728.0, 0.0, 1741.0, 518.0, 0.0, 0.0, 1.0],
    "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
    "P": PROJECTION,
}
LAYOUT_B: dict[str, object] = {
    "camera_matrix": {"rows": 3, "cols": 3, "data": LAYOUT_A["K"]},
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": LAYOUT_A["D"]},
    "distortion_model": "plumb_bob",
    "image_height": 1080,
    "image_width": 1440,
    "projection_matrix": {"rows": 3, "cols": 4, "data": PROJECTION},
    "rectification_matrix": {"rows": 3, "cols": 3, "data": LAYOUT_A["R"]},
}
CAMERA = Calibration(1440, 1080, FOCAL, CX, CY, BASELINE_M * 1000)


def write(path: Path, entries: dict[str, object]) -> Path:
    path.write_text(yaml.safe_dump(entries))
    return path


def changed(**entries: object) -> dict[str, object]:
    return {**LAYOUT_A, **entries}


def with_projection(**numbers: float) -> dict[str, object]:
    """Layout A with some numbers of P changed, as in p3=0.0."""
    projection = list(PROJECTION)
    for name, value in numbers.items():
        projection[int(name[1:])] = value
    return changed(P=projection)


def assert_camera(found: Calibration, expected: Calibration = CAMERA) -> None:
    assert (found.width_px, found.height_px) == (expected.width_px, expected.height_px)
    for name in ("focal_px", "cx_px", "cy_px", "baseline_mm"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), abs=1e-6), name


@pytest.mark.parametrize("entries", [LAYOUT_A, LAYOUT_B], ids=["A", "B"])
def test_both_layouts_of_the_right_eye_are_read(tmp_path: Path, entries: dict[str, object]) -> None:
    assert_camera(load_rectified(write(tmp_path / "right.yml", entries)))


@pytest.mark.parametrize(
    ("name", "focal", "baseline"),
    [
        ("2022_05_21", 1705.08, 60.00),
        ("2022_05_24", 1716.03, 60.18),
        ("robot_2023_05_17", 1716.64, 59.84),
    ],
)
def test_the_real_cameras_files_are_read(
    real: Path, name: str, focal: float, baseline: float
) -> None:
    camera = load_rectified(real / "calibration" / f"{name}.yml")
    assert camera.focal_px == pytest.approx(focal, abs=0.01)
    assert camera.baseline_mm == pytest.approx(baseline, abs=0.005)
    assert (camera.width_px, camera.height_px) == (1440, 1080)


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        (with_projection(p3=0.0), "left camera's file"),
        (with_projection(p3=0.0, p7=-100.0), "one eye above the other"),
        (with_projection(p3=100.0), "swapped"),
        (with_projection(p3=float("nan")), "finite"),
        (with_projection(p2=float("inf")), "finite"),
        (with_projection(p0=0.0), "focal length"),
        (with_projection(p0=-1717.0, p5=-1717.0), "focal length"),
        (with_projection(p5=1800.0), "two focal lengths"),
        (with_projection(p3=-FOCAL * 59.9), "`units: cm` or `units: mm`"),
        (with_projection(p3=-FOCAL * 400), "needs the line `units: mm`"),
        (with_projection(p3=-FOCAL * 5000), "It is no such distance in m, cm or mm."),
        (with_projection(p3=-FOCAL * 0.005), "outside 10 to 1000 mm"),
        (changed(units="mm"), "needs the line `units: m`"),
        (changed(units=["mm"]), "a list under units"),
        (changed(units="-3 mm"), "units as '-3 mm'"),
        (changed(units="furlongs"), "units"),
        (changed(width=0), "image size"),
        (changed(height=-1080), "image size"),
        (changed(P=PROJECTION[:11]), "12 are needed"),
        (changed(P="eleven"), "finite"),
        (
            {k: v for k, v in LAYOUT_A.items() if k != "P"},
            "one lens and not where the other eye is",
        ),
        ({k: v for k, v in LAYOUT_A.items() if k != "width"}, "image size"),
        ({"M1": 1, "M2": 2}, "--rectify"),
    ],
)
def test_an_impossible_rectified_camera_is_refused(
    tmp_path: Path, entries: dict[str, object], words: str
) -> None:
    with pytest.raises(CalibrationInvalid) as refused:
        load_rectified(write(tmp_path / "right.yml", entries))
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\n \n", "is empty"),
        (b"\x89PNG\r\n\x1a\n\xff\xfe", "is a picture"),
        (b"P: [1, 2", "is no YAML file"),
        (b"{a: " * 2000, "nests its entries too deep"),
        (b"just words", "is no calibration file"),
        (b"<?xml version='1.0'?><opencv_storage/>", "is XML"),
        (b"a: " + b"x" * 2_000_000, "too large"),
    ],
)
def test_what_is_no_calibration_file_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "right.yml"
    path.write_bytes(content)
    for load in (load_rectified, load_stereo_rig):
        with pytest.raises(CalibrationInvalid) as refused:
            load(path)
        assert words in str(refused.value)


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    for load in (load_rectified, load_stereo_rig):
        with pytest.raises(CalibrationInvalid, match="There is no calibration file"):
            load(tmp_path / "absent.yml")
    with pytest.raises(CalibrationInvalid, match="is a folder"):
        load_rectified(tmp_path)
    with pytest.raises(CalibrationInvalid, match="holds no stereo calibration"):
        load_stereo_rig(tmp_path)


def opencv_parts() -> tuple[dict[str, Entry], dict[str, Entry]]:
    """What OpenCV's stereo calibration sample writes: intrinsics, extrinsics."""
    matrix = np.array([(1740.0, 0, 728.0), (0, 1741.0, 518.0), (0, 0, 1)])
    distortion = np.array([[-0.28, 0.18, 0.002, 0.0008, 0.0]])
    rotation = cv2.Rodrigues(np.array([0.001, -0.02, 0.003]))[0]
    translation = np.array([[-0.06], [0.0005], [0.0002]])
    r1, r2, p1, p2, q, *_ = cv2.stereoRectify(
        matrix, distortion, matrix, distortion, (1440, 1080), rotation, translation
    )
    intrinsics: dict[str, Entry] = {"M1": matrix, "D1": distortion, "M2": matrix, "D2": distortion}
    extrinsics = {"R": rotation, "T": translation, "R1": r1, "R2": r2, "P1": p1, "P2": p2, "Q": q}
    return intrinsics, dict(extrinsics)


def write_opencv(path: Path, entries: Mapping[str, Entry]) -> Path:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, entry in entries.items():
        if isinstance(entry, np.ndarray):
            storage.write(name, entry)
        else:
            storage.write(name, entry)
    storage.release()
    return path


def test_opencvs_folder_needs_the_image_size_from_the_caller(tmp_path: Path) -> None:
    intrinsics, extrinsics = opencv_parts()
    write_opencv(tmp_path / "intrinsics.yml", intrinsics)
    write_opencv(tmp_path / "extrinsics.yml", extrinsics)
    rig = load_stereo_rig(tmp_path, (1440, 1080))
    p2 = np.asarray(extrinsics["P2"])
    assert_camera(
        rig.rectified,
        Calibration(1440, 1080, p2[0, 0], p2[0, 2], p2[1, 2], -1000 * p2[0, 3] / p2[0, 0]),
    )
    assert np.allclose(rig.left.rotation, np.asarray(extrinsics["R1"]))
    assert np.allclose(rig.right.distortion, [-0.28, 0.18, 0.002, 0.0008, 0.0])
    with pytest.raises(CalibrationInvalid, match="image size"):
        load_stereo_rig(tmp_path)


@pytest.mark.parametrize("version", ["%YAML:1.0", "%YAML 1.0"])
@pytest.mark.parametrize(
    "names",
    ["M1 D1 M2 D2", "K1 D1 K2 D2", "cameraMatrix1 distCoeffs1 cameraMatrix2 distCoeffs2"],
)
def test_one_opencv_file_without_rectification_is_completed(
    tmp_path: Path, names: str, version: str
) -> None:
    intrinsics, extrinsics = opencv_parts()
    renamed = dict(zip(names.split(), intrinsics.values(), strict=True))
    pose = {name: extrinsics[name] for name in ("R", "T")}
    size = {"image_width": 1440, "image_height": 1080}
    path = write_opencv(tmp_path / "stereo.yml", {**renamed, **pose, **size})
    path.write_text(path.read_text().replace("%YAML:1.0", version))
    rig = load_stereo_rig(path)
    assert rig.rectified.baseline_mm == pytest.approx(60.0, abs=0.01)
    assert np.array_equal(rig.left.projection, rig.right.projection)
    assert rig.rectified.focal_px > 1500


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"T": np.array([-60.0, 0.5, 0.2])}, "`units: cm` or `units: mm`"),
        ({"T": np.array([-3.34, 0.05, 0.0])}, "counts squares of the calibration board"),
        ({"T": np.array([-3.34, 0.05, 0.0]), "units": "mm"}, "counts squares of the calibration"),
        ({"camera_model": "fisheye"}, "fisheye lens (camera_model: fisheye)"),
        ({"fisheye_model": 1}, "fisheye lens (fisheye_model)"),
        ({"D1": np.array([0.1, 0.02, 0.0, 0.0])}, "four distortion coefficients"),
        ({"camera_model": "mei"}, "a lens that is not known (camera_model: mei)"),
        ({"T": np.array([0.06, 0.0, 0.0])}, "swapped"),
        ({"T": np.array([0.0, -0.06, 0.0])}, "one eye above the other"),
        ({"T": np.array([-0.06, 0.0])}, "3 are needed"),
        ({"R1": np.eye(3) * 2}, "no rotation"),
        ({"M1": np.zeros((3, 3))}, "focal length"),
        ({"D2": np.zeros(3)}, "distortion coefficients"),
        ({"M2": np.full((3, 3), np.nan)}, "finite"),
        ({"image_width": -3}, "image size"),
    ],
)
def test_an_impossible_raw_camera_is_refused(
    tmp_path: Path, changes: dict[str, Entry], words: str
) -> None:
    intrinsics, extrinsics = opencv_parts()
    size: dict[str, Entry] = {"image_width": 1440, "image_height": 1080}
    path = write_opencv(tmp_path / "s.yml", {**intrinsics, **extrinsics, **size, **changes})
    with pytest.raises(CalibrationInvalid) as refused:
        load_stereo_rig(path)
    assert words in str(refused.value)


def test_units_in_the_file_are_believed(tmp_path: Path) -> None:
    intrinsics, extrinsics = opencv_parts()
    for name in ("R1", "R2", "P1", "P2", "Q"):
        del extrinsics[name]
    extrinsics["T"] = np.array([-60.0, 0.5, 0.2])
    path = write_opencv(tmp_path / "s.yml", {**intrinsics, **extrinsics, "units": "mm"})
    assert load_stereo_rig(path, (1440, 1080)).rectified.baseline_mm == pytest.approx(60, abs=0.01)


def test_lengths_in_board_squares_are_read_where_a_square_is_known(tmp_path: Path) -> None:
    intrinsics, extrinsics = opencv_parts()
    for name in ("R1", "R2", "P1", "P2", "Q"):
        del extrinsics[name]
    extrinsics["T"] = np.array([-2.4, 0.0, 0.0])
    path = write_opencv(tmp_path / "s.yml", {**intrinsics, **extrinsics, "units": "25 mm"})
    assert load_stereo_rig(path, (1440, 1080)).rectified.baseline_mm == pytest.approx(60, abs=0.01)


def test_a_folder_with_both_eyes_files(tmp_path: Path) -> None:
    left = {**with_projection(p3=0.0, p2=CX + 12.0)}
    write(tmp_path / "left.yml", left)
    write(tmp_path / "right.yml", LAYOUT_B)
    rig = load_stereo_rig(tmp_path)
    assert rig.rectified.cx_px == CX + 12.0
    assert rig.right.projection[0, 2] == CX + 12.0
    assert rig.rectified.baseline_mm == pytest.approx(BASELINE_M * 1000)


def test_swapped_files_of_the_eyes_are_refused(tmp_path: Path) -> None:
    write(tmp_path / "left.yml", LAYOUT_A)
    write(tmp_path / "right.yml", with_projection(p3=0.0))
    with pytest.raises(CalibrationInvalid, match="eyes swapped"):
        load_stereo_rig(tmp_path)


MUTATIONS = [b"", b"-", b"[", b"&a ", b"*a", b"!!int ", b"9e999", b".Nan", b"{", b"\x00"]

FUZZ = settings(suppress_health_check=list(HealthCheck))


def assert_read_or_refused(path: Path) -> None:
    for load in (load_rectified, load_stereo_rig):
        try:
            load(path)
        except FieldcamError as error:
            assert error.message.endswith(".") and "\n" not in error.message


@FUZZ
@given(content=st.binary(max_size=300))
def test_fuzz_random_bytes_are_read_or_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "f.yml").write_bytes(content)
    assert_read_or_refused(tmp_path / "f.yml")


@FUZZ
@given(data=st.data(), which=st.sampled_from(["A", "B", "opencv"]))
def test_fuzz_mutated_files_are_read_or_refused(
    tmp_path: Path, data: st.DataObject, which: str
) -> None:
    path = tmp_path / "f.yml"
    if which == "opencv":
        intrinsics, extrinsics = opencv_parts()
        size: dict[str, Entry] = {"image_width": 1440, "image_height": 1080}
        write_opencv(path, {**intrinsics, **extrinsics, **size})
    else:
        write(path, LAYOUT_A if which == "A" else LAYOUT_B)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place : place + data.draw(st.integers(0, 3))] = data.draw(
            st.sampled_from(
                [b"", b"-", b"[", b"&a ", b"*a", b"!!int ", b"9e999", b".Nan", b"{", b"\x00"]
            )
        )
    path.write_bytes(bytes(content))
    assert_read_or_refused(path)
