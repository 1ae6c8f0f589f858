"""Raw pairs become rectified ones: same row, one principal point, true colours."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from fieldcam.calibration.reading.documents import CalibrationDocument
from fieldcam.calibration.rectification import Rectifier, demosaic, develop
from fieldcam.calibration.rig import EyeLens, StereoRig, assemble_rig
from fieldcam.errors import PairMismatch
from fieldcam.values import ImageU8, PixelFormat, RawPair, StereoPair

Array = npt.NDArray[np.float64]

SIZE = (360, 270)
MATRIX = np.array([(430.0, 0, 182.0), (0, 431.0, 130.0), (0, 0, 1)])
DISTORTION = np.array([-0.28, 0.15, 0.001, 0.0005, 0.0])
ROTATION = np.asarray(cv2.Rodrigues(np.array([0.01, -0.03, 0.02]))[0], np.float64)
TRANSLATION = np.array([[-0.06], [0.001], [0.0005]])


def make_rig(path: Path, flags: int = cv2.CALIB_ZERO_DISPARITY) -> StereoRig:
    r1, r2, p1, p2, *_ = cv2.stereoRectify(
        MATRIX, DISTORTION, MATRIX, DISTORTION, SIZE, ROTATION, TRANSLATION, flags=flags, alpha=0
    )
    eyes = [
        EyeLens(MATRIX, DISTORTION, np.asarray(rotation, np.float64), np.eye(3))
        for rotation in (r1, r2)
    ]
    projections = np.asarray(p1, np.float64), np.asarray(p2, np.float64)
    return assemble_rig(CalibrationDocument(path, {}), eyes[0], eyes[1], projections, SIZE)


POINTS_MM = np.array([(0, 0, 400), (60, 40, 450), (-70, 30, 520), (20, -60, 600)], dtype=np.float64)


def spots(points_mm: Array, rotation: Array, translation_mm: Array) -> ImageU8:
    """A raw picture with a soft spot at each point's distorted projection."""
    projected, _ = cv2.projectPoints(
        points_mm, cv2.Rodrigues(rotation)[0], translation_mm, MATRIX, DISTORTION
    )
    rows, columns = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    picture = np.zeros(rows.shape)
    for x, y in projected.reshape(-1, 2):
        picture += 200 * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * 1.5**2))
    return np.repeat(np.rint(picture).astype(np.uint8)[..., None], 3, axis=2)


def spot_near(picture: ImageU8, expected: Array) -> Array:
    x0, y0 = np.rint(expected).astype(int) - 6
    window = picture[y0 : y0 + 13, x0 : x0 + 13, 0].astype(np.float64)
    rows, columns = np.mgrid[0:13, 0:13]
    return np.array(
        [(columns * window).sum() / window.sum() + x0, (rows * window).sum() / window.sum() + y0]
    )


@pytest.mark.parametrize("flags", [cv2.CALIB_ZERO_DISPARITY, 0], ids=["one center", "two centers"])
def test_points_land_where_the_rectified_camera_sees_them(tmp_path: Path, flags: int) -> None:
    rig = make_rig(tmp_path, flags)
    raw = StereoPair(
        spots(POINTS_MM, np.eye(3), np.zeros(3)), spots(POINTS_MM, ROTATION, TRANSLATION * 1000)
    )
    pair = Rectifier(rig).rectify(raw)
    camera = rig.rectified
    for point in POINTS_MM @ rig.left.rotation.T:
        x = camera.focal_px * point[0] / point[2] + camera.cx_px
        y = camera.focal_px * point[1] / point[2] + camera.cy_px
        expected_left = np.array([x, y])
        expected_right = expected_left - (camera.disparity_px(point[2]), 0)
        assert np.abs(spot_near(pair.left, expected_left) - expected_left).max() < 0.1
        assert np.abs(spot_near(pair.right, expected_right) - expected_right).max() < 0.1


def test_images_of_another_size_are_refused(tmp_path: Path) -> None:
    image = np.zeros((10, 10, 3), np.uint8)
    with pytest.raises(PairMismatch, match="10 x 10"):
        Rectifier(make_rig(tmp_path)).rectify(StereoPair(image, image))


def test_the_rectified_size_is_the_raw_one(tmp_path: Path) -> None:
    image = np.full((SIZE[1], SIZE[0], 3), 99, np.uint8)
    pair = Rectifier(make_rig(tmp_path)).rectify(StereoPair(image, image))
    assert pair.size_px == SIZE
    assert pair.left[SIZE[1] // 2, SIZE[0] // 2].tolist() == [99, 99, 99]


COLOUR = (200, 120, 40)
PATTERNS = {
    PixelFormat.BAYER_RG8: ((0, 1), (1, 2)),
    PixelFormat.BAYER_GB8: ((1, 2), (0, 1)),
    PixelFormat.BAYER_GR8: ((1, 0), (2, 1)),
    PixelFormat.BAYER_BG8: ((2, 1), (1, 0)),
}


@pytest.mark.parametrize("pixel_format", list(PATTERNS))
def test_bayer_patterns_keep_their_colours(pixel_format: PixelFormat) -> None:
    channels = np.tile(np.array(PATTERNS[pixel_format]), (10, 10))
    raw = np.array(COLOUR, np.uint8)[channels]
    assert (demosaic(raw, pixel_format)[4:-4, 4:-4] == COLOUR).all()


def test_develop_gives_three_channels_whatever_the_format() -> None:
    grey = np.full((20, 20), 70, np.uint8)
    raw = RawPair(grey, grey, PixelFormat.MONO8, datetime.now(UTC), 0, 0, "L", "R", 1)
    assert (develop(raw).left == np.full((20, 20, 3), 70)).all()
    coloured = np.zeros((20, 20, 3), np.uint8)
    raw = replace(raw, left=coloured, right=coloured, pixel_format=PixelFormat.RGB8)
    assert develop(raw).right is coloured
