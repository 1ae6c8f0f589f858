"""Calibrations of other programs are read, and what is no camera of this kind is named."""

from __future__ import annotations

import io
import re
import tarfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcam.calibration.reading.camera_info import Window
from fieldcam.calibration.reading.readers import load_camera, load_rectified, load_stereo_rig
from fieldcam.calibration.reading.sources import WHOLE, open_documents
from fieldcam.errors import CalibrationInvalid
from fieldcam.values import Calibration

SAMPLES = Path(__file__).parents[1] / "foreign_samples"
CASES = SAMPLES / "calibration"
RIGHT = Calibration(1440, 1080, 1716.03, 732.9, 488.7, 60.18)


def assert_right_eye(found: Calibration, expected: Calibration = RIGHT) -> None:
    assert (found.width_px, found.height_px) == (expected.width_px, expected.height_px)
    for name in ("focal_px", "cx_px", "cy_px", "baseline_mm"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), abs=1e-3), name


@pytest.mark.parametrize(
    "name", ["ros1_echo.yml", "ros2_echo.yml", "ost.txt", "calibrationdata.tar.gz"]
)
def test_a_right_eye_is_read_as_ros_prints_and_keeps_it(name: str) -> None:
    assert_right_eye(load_rectified(CASES / name))


@pytest.mark.parametrize("code", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "latin-1"])
def test_an_echo_is_read_in_whatever_code_it_was_redirected(tmp_path: Path, code: str) -> None:
    text = (
        (CASES / "ros2_echo.yml")
        .read_text()
        .replace("frame_id: camera", "frame_id: Kamera_gr\xfcn")
    )
    path = tmp_path / "right.yml"
    path.write_bytes(text.replace("\n", "\r\n").encode(code))
    assert_right_eye(load_rectified(path))


def test_one_eye_alone_is_no_raw_pair() -> None:
    for name in ("ros1_echo.yml", "ost.txt"):
        with pytest.raises(CalibrationInvalid, match="describes one eye, and --rectify needs both"):
            load_stereo_rig(CASES / name)


def test_an_echo_that_goes_on_or_was_cut_is_one_camera(tmp_path: Path) -> None:
    text = (CASES / "ros1_echo.yml").read_text()
    path = tmp_path / "right.yml"
    path.write_text(text + text.replace("seq: 1", "seq: 2") + text[:200])
    assert_right_eye(load_rectified(path))
    for other in (text.replace("1440", "1920"), text.replace("x_offset: 0", "x_offset: 4")):
        path.write_text(text + other)
        with pytest.raises(CalibrationInvalid, match="several cameras, one behind the other"):
            load_rectified(path)


@pytest.mark.parametrize("name", ["ros1_echo.yml", "ros2_echo.yml"])
def test_a_print_may_be_cut_anywhere(tmp_path: Path, name: str) -> None:
    text = (CASES / name).read_text()
    path = tmp_path / "right.yml"
    for end in range(len(text)):
        path.write_text(text + text[:end])
        assert_right_eye(load_rectified(path))


@pytest.mark.parametrize(
    "text", ["camera_info:\n{}", "topic: /right/camera_info\nmessage:\n{}"], ids=["alone", "beside"]
)
def test_a_camera_may_stand_under_a_name(tmp_path: Path, text: str) -> None:
    inner = (CASES / "ros1_echo.yml").read_text().replace("---", "")
    path = tmp_path / "right.yml"
    path.write_text(text.format("".join(f"  {line}\n" for line in inner.splitlines())))
    assert_right_eye(load_rectified(path))


def test_kalibrs_camchain_is_a_raw_pair(tmp_path: Path) -> None:
    rig = load_stereo_rig(CASES / "kalibr_camchain.yaml")
    assert rig.rectified.baseline_mm == pytest.approx(60.18, abs=0.01)
    assert rig.size_px == (1440, 1080)
    assert np.allclose(rig.left.distortion, [-0.29, 0.18, 0.001, 0.0005])
    assert rig.left.camera_matrix[0, 2] == 732.9
    with pytest.raises(CalibrationInvalid, match="--rectify"):
        load_rectified(CASES / "kalibr_camchain.yaml")


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("distortion_model: radtan", "distortion_model: equidistant", "fisheye lens"),
        ("camera_model: pinhole", "camera_model: omni", "not known (camera_model: omni)"),
        ("cam1:", "camB:", "one camera only"),
        ("cam0:", "cam2: {}\ncam0:", "more than two cameras"),
    ],
)
def test_kalibrs_other_cameras_are_named(
    tmp_path: Path, before: str, after: str, words: str
) -> None:
    path = tmp_path / "camchain.yaml"
    path.write_text((CASES / "kalibr_camchain.yaml").read_text().replace(before, after))
    with pytest.raises(CalibrationInvalid) as refused:
        load_stereo_rig(path)
    assert words in str(refused.value)


def both_eyes_ost() -> str:
    right = (CASES / "ost.txt").read_text()
    left = right.replace("/right", "/left").replace("-103.270685", "0.000000")
    return left + right


def test_ost_of_both_eyes_is_a_raw_pair(tmp_path: Path) -> None:
    path = tmp_path / "ost.txt"
    path.write_text(both_eyes_ost())
    assert_right_eye(load_stereo_rig(path).rectified)
    assert_right_eye(load_rectified(path))


def moved_left(before: str, after: str) -> str:
    """Of both eyes in one file, the left one's projection changed."""
    right = (CASES / "ost.txt").read_text()
    left = right.replace("/right", "/left").replace("-103.270685", "0.000000")
    begin, projection = left.split("projection")
    return f"{begin}projection{projection.replace(before, after)}{right}"


def as_tarball(path: Path, text: str) -> Path:
    with tarfile.open(path / "calibrationdata.tar.gz", "w:gz") as archive:
        member = tarfile.TarInfo("ost.txt")
        member.size = len(text)
        archive.addfile(member, io.BytesIO(text.encode()))
    return path / "calibrationdata.tar.gz"


def as_ost(path: Path, text: str) -> Path:
    (path / "ost.txt").write_text(text)
    return path / "ost.txt"


def as_two_files(path: Path, text: str) -> Path:
    right = (CASES / "ost.txt").read_text()
    (path / "left_ost.txt").write_text(text.removesuffix(right))
    (path / "right_ost.txt").write_text(right)
    return path / "right_ost.txt"


@pytest.mark.parametrize("written", [as_ost, as_tarball, as_two_files])
@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("732.900000", "700.900000", "at (732.9, 488.7) px, and the left eye's at (700.9, 488.7)"),
        ("488.700000", "480.000000", "the left eye's at (732.9, 480)"),
        ("1716.030000", "1700.000000", "two focal lengths: 1716.03 and 1700 px"),
        ("732.900000", "732.950000", ""),
    ],
)
def test_rectified_eyes_have_one_centre_and_one_focal_length(
    tmp_path: Path, written: Callable[[Path, str], Path], before: str, after: str, words: str
) -> None:
    path = written(tmp_path, moved_left(before, after))
    if not words:
        assert_right_eye(load_rectified(path))
        return
    with pytest.raises(CalibrationInvalid) as refused:
        load_rectified(path)
    assert words in str(refused.value)
    assert "--rectify" in refused.value.hint


@pytest.mark.parametrize("mode", ["w:gz", "w:bz2", "w:xz", "w"])
def test_a_tarball_of_both_eyes_is_a_raw_pair(tmp_path: Path, mode: str) -> None:
    path = tmp_path / "calibrationdata"
    ost, picture = both_eyes_ost().encode(), bytes(3_000_000)
    with tarfile.open(path, mode) as archive:  # type: ignore[call-overload]
        for name, content in (("left-0000.png", picture), ("ost.txt", ost)):
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    found = load_camera(path)
    assert not isinstance(found, Calibration)
    assert_right_eye(found.rectified)


def test_what_lies_beside_a_whole_camera_may_be_anything(tmp_path: Path) -> None:
    (tmp_path / "left.txt").write_text(both_eyes_ost().replace("/right", "/other"))
    (tmp_path / "ost.txt").write_text(both_eyes_ost())
    (tmp_path / "camchain.yaml").write_bytes(b"\x00\xff{")
    assert_right_eye(load_stereo_rig(tmp_path).rectified)


def test_binning_and_a_cut_out_are_applied(tmp_path: Path) -> None:
    half = Calibration(720, 540, 858.015, 366.2, 244.1, 60.18)
    assert_right_eye(load_rectified(CASES / "binning2.yml"), half)
    text = (CASES / "ros1_echo.yml").read_text()
    path = tmp_path / "right.yml"
    cut = "x_offset: 100, y_offset: 20, height: 800, width: 1200"
    path.write_text(text.replace("x_offset: 0, y_offset: 0, height: 0, width: 0", cut))
    assert_right_eye(load_rectified(path), Calibration(1200, 800, 1716.03, 632.9, 468.7, 60.18))
    path.write_text(text.replace("x_offset: 0", "x_offset: 2000"))
    with pytest.raises(CalibrationInvalid, match=r"cuts .* out of a picture of 1440 x 1080"):
        load_rectified(path)
    path.write_text(text.replace("binning_x: 1", "binning_x: 2"))
    with pytest.raises(CalibrationInvalid, match="two focal lengths"):
        load_rectified(path)
    path.write_text(text.replace("binning_x: 1", "binning_x: 1.5"))
    with pytest.raises(CalibrationInvalid, match=r"1.5 under binning_x"):
        load_rectified(path)


@pytest.mark.parametrize("written", ["roi:", "roi: null", "roi: None", "roi: {}", "roi: ''"])
def test_a_cut_out_of_nothing_is_none(tmp_path: Path, written: str) -> None:
    text = (CASES / "ros1_echo.yml").read_text()
    path = tmp_path / "right.yml"
    path.write_text(re.sub("roi:.*", written, text))
    assert_right_eye(load_rectified(path))


def test_a_picture_that_is_binned_already_names_the_binning(tmp_path: Path) -> None:
    text = (CASES / "binning2.yml").read_text()
    path = tmp_path / "right.yml"
    path.write_text(text.replace("1080", "540").replace("1440", "720"))
    (tmp_path / "left.yml").write_text(path.read_text().replace("-103.2706854", "0.0"))
    for load, file in ((load_rectified, path), (load_camera, path), (load_stereo_rig, tmp_path)):
        with pytest.raises(CalibrationInvalid, match="bins 2 x 2 pixels") as refused:
            load(file, (720, 540))
        assert "remove binning_x" in refused.value.hint
    assert_right_eye(
        load_rectified(CASES / "binning2.yml", (720, 540)),
        Calibration(720, 540, 858.015, 366.2, 244.1, 60.18),
    )


def opencv(names: str, more: str = "", shift: float = -0.06018) -> str:
    """What a stereo program writes, its four lens entries under these names."""
    matrix, lens = [1716.03, 0, 732.9, 0, 1716.03, 488.7, 0, 0, 1], [-0.1, 0.1, 0, 0, 0]
    entries = [
        f"{name}: !!opencv-matrix\n   rows: 1\n   cols: {len(data)}\n   dt: d\n   data: {data}\n"
        for name, data in zip(names.split(), (matrix, matrix, lens, lens), strict=True)
    ]
    rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    return f"%YAML:1.0\n---\n{''.join(entries)}R: {rotation}\nT: [{shift}, 0, 0]\n{more}"


KNOWN_NAMES = "K1 K2 D1 D2"


@pytest.mark.parametrize(
    "names",
    [
        "mtxL mtxR distL distR",
        "K_l K_r D_l D_r",
        "camera_matrix_1 camera_matrix_2 dist_1 dist_2",
        "LEFT_K RIGHT_K LEFT_D RIGHT_D",
        "Camera_1_Matrix Camera_2_Matrix Camera_1_Distortion Camera_2_Distortion",
    ],
)
def test_two_raw_eyes_by_other_names_are_told(tmp_path: Path, names: str) -> None:
    path = tmp_path / "stereo.yml"
    path.write_text(opencv(names))
    for load in (load_rectified, load_stereo_rig):
        with pytest.raises(CalibrationInvalid) as refused:
            load(path, (1440, 1080))
        left, right, *_ = names.split()
        assert f"two raw eyes ({left} and {right})" in str(refused.value)
        assert "M1, D1, M2, D2" in refused.value.hint and "--rectify" in refused.value.hint


@pytest.mark.parametrize(
    "entry",
    [
        "lens: fisheye", "camera_type: Fisheye", "projection_model: equidistant",
        "anything: double-sphere", "model: Kannala Brandt", "type: omni", "camera: fov",
    ],
)  # fmt: skip
def test_another_lens_is_told_under_any_name(tmp_path: Path, entry: str) -> None:
    path = tmp_path / "stereo.yml"
    path.write_text(opencv(KNOWN_NAMES, f"{entry}\n"))
    with pytest.raises(CalibrationInvalid, match="another lens than a pinhole"):
        load_stereo_rig(path, (1440, 1080))


@pytest.mark.parametrize(
    ("shift", "units", "baseline_mm"),
    [
        (-0.06, "", 60),
        (-0.6, "", None),
        (-0.12, "", None),
        (-0.12, "m", 120),
        (-600, "mm", 600),
        (-2.4, "25mm", 60),
        (-2.4, "25 mm", 60),
        (-2.4, "0.025m", 60),
        (-2.4, "25", None),
        (-2.4, "mm 25", None),
    ],
)
def test_lengths_are_what_the_file_says(
    tmp_path: Path, shift: float, units: str, baseline_mm: float | None
) -> None:
    path = tmp_path / "stereo.yml"
    path.write_text(opencv(KNOWN_NAMES, f"units: {units}\n" if units else "", shift))
    if baseline_mm is None:
        with pytest.raises(CalibrationInvalid, match="units"):
            load_stereo_rig(path, (1440, 1080))
    else:
        rig = load_stereo_rig(path, (1440, 1080))
        assert rig.rectified.baseline_mm == pytest.approx(baseline_mm)


def test_a_raw_pair_is_binned_too(tmp_path: Path) -> None:
    text = (CASES / "binning2.yml").read_text()
    (tmp_path / "right.yml").write_text(text)
    (tmp_path / "left.yml").write_text(text.replace("-103.2706854", "0.0"))
    rig = load_stereo_rig(tmp_path)
    assert rig.size_px == (720, 540)
    assert rig.left.camera_matrix[0, 0] == pytest.approx(858.015)


@given(
    x=st.integers(0, 300),
    y=st.integers(0, 300),
    binning=st.integers(1, 4),
    at=st.tuples(st.integers(0, 200), st.integers(0, 200)),
)
def test_a_window_moves_a_pixel_to_the_middle_of_what_was_binned(
    x: int, y: int, binning: int, at: tuple[int, int]
) -> None:
    seen = Window(x, y, 800, 800, binning, binning)
    inner = (binning - 1) / 2
    on_sensor = np.array([x + at[0] * binning + inner, y + at[1] * binning + inner, 1.0])
    assert seen.applied(np.eye(3)) @ on_sensor == pytest.approx([*at, 1.0])


def test_a_fisheye_lens_is_refused_by_name() -> None:
    for load in (load_stereo_rig, load_camera):
        with pytest.raises(CalibrationInvalid, match=r"fisheye lens \(camera_model: fisheye\)"):
            load(CASES / "fisheye")


@pytest.mark.parametrize("units", ["", "units: mm\n", "units: m\n"])
def test_lengths_in_board_squares_are_told_without_a_circle(tmp_path: Path, units: str) -> None:
    for name in ("intrinsics.yml", "extrinsics.yml"):
        text = (CASES / "opencv_board_squares" / name).read_text()
        (tmp_path / name).write_text(text + (units if name == "extrinsics.yml" else ""))
    with pytest.raises(CalibrationInvalid) as refused:
        load_stereo_rig(tmp_path, (640, 480))
    assert refused.value.hint.startswith("If 3.343 counts squares of the calibration board")
    assert "`units: mm`" not in refused.value.hint
    (tmp_path / "extrinsics.yml").write_text(
        (CASES / "opencv_board_squares" / "extrinsics.yml").read_text() + "units: 18 mm\n"
    )
    assert load_stereo_rig(tmp_path, (640, 480)).rectified.baseline_mm == pytest.approx(
        60.2, abs=0.1
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"PK\x03\x04....", "is a zip archive"),
        (b"MATLAB 5.0 MAT-file", "is a MATLAB file"),
        (b"\x80\x04\x95", "is a Python pickle"),
        (b"[LEFT_CAM_HD]\nfx=1", "a ZED camera's settings"),
        (b"camera_matrix: [1, 0, 0]\ndist_coeff: [0]\n", "one lens and not where the other eye"),
        (b"\x1f\x8b broken", "damaged archive"),
        (b"header: 1\n---\nheader: 2\n", "has no entry P"),
    ],
)
def test_what_is_no_camera_of_this_kind_is_named(
    tmp_path: Path, content: bytes, words: str
) -> None:
    path = tmp_path / "calibration.yml"
    path.write_bytes(content)
    with pytest.raises(CalibrationInvalid) as refused:
        load_rectified(path)
    assert words in str(refused.value)


BOMBS = {
    "aliases": (SAMPLES / "hostile" / "alias_bomb.yml").read_bytes(),
    "aliases of mappings": b"a0: &a0 {b: 1, c: 2}\n"
    + b"".join(b"a%d: &a%d {b: *a%d, c: *a%d}\n" % (i, i, i - 1, i - 1) for i in range(1, 60)),
    "numbers": b"P: [" + b"1," * 400_000 + b"]",
    "nesting": b"[" * 900_000,
    "spaces": b"a: b" + b" \n" * 400_000 + b"c",
    "documents": b"---\n" * 200_000,
    "itself": b"a: &a [*a]",
}


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_are_refused_at_once(tmp_path: Path, name: str) -> None:
    path = tmp_path / "calibration.yml"
    path.write_bytes(BOMBS[name])
    began_s = time.process_time()
    with pytest.raises(CalibrationInvalid) as refused:
        open_documents(path)
    assert time.process_time() - began_s < 2
    assert len(str(refused.value)) < 400


def test_a_part_that_is_named_twice_is_read(tmp_path: Path) -> None:
    """As PyYAML writes it where both eyes share their numbers."""
    text = (CASES / "ros2_echo.yml").read_text().replace("k:\n", "k: &id001\n")
    path = tmp_path / "right.yml"
    path.write_text(text.replace("---\n", "copy: *id001\n"))
    assert_right_eye(load_rectified(path))
    entries = open_documents(path)[WHOLE].entries
    assert entries["copy"] == entries["k"]
