"""A tag of known size shows when a calibration no longer fits its camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldcam.calibration.drift import (
    measured_tag_size_mm,
    row_disagreement_px,
    tag_disparity_px,
    tag_size_error,
)
from fieldcam.values import TAG_SIZE_MM, Calibration, TagPose

CAMERA = Calibration(1440, 1080, 1717.0, 719.5, 539.5, 60.0)
SQUARE_MM = np.array([(-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)]) * TAG_SIZE_MM / 2


def seen(tag_id: int, x_mm: float, row_shift_px: float = 0.0, tilt_rad: float = 0.4) -> TagPose:
    """A tilted tag 440 mm away, seen by an eye at -x_mm on the baseline."""
    turn = np.array(
        [
            (np.cos(tilt_rad), 0, np.sin(tilt_rad)),
            (0, 1, 0),
            (-np.sin(tilt_rad), 0, np.cos(tilt_rad)),
        ]
    )
    points = SQUARE_MM @ turn.T + (x_mm, 10.0, 440.0)
    corners = tuple(
        (
            float(CAMERA.focal_px * x / z + CAMERA.cx_px),
            float(CAMERA.focal_px * y / z + CAMERA.cy_px + row_shift_px),
        )
        for x, y, z in points
    )
    return TagPose(tag_id, corners[0], corners, None, None, 50.0)


GOOD = (seen(17, 5.0), seen(17, -55.0))


def test_a_good_calibration_measures_the_printed_size() -> None:
    assert measured_tag_size_mm(GOOD, CAMERA) == pytest.approx(TAG_SIZE_MM, abs=1e-6)
    assert tag_size_error(GOOD, CAMERA) == pytest.approx(0.0, abs=1e-6)
    assert tag_disparity_px(GOOD) == pytest.approx(CAMERA.disparity_px(440.0), rel=0.01)


@pytest.mark.parametrize("factor", [0.97, 1.02])
def test_a_wrong_baseline_shows_as_a_wrong_size(factor: float) -> None:
    camera = replace(CAMERA, baseline_mm=60.0 * factor)
    assert tag_size_error(GOOD, camera) == pytest.approx(factor - 1, abs=1e-6)


def test_swapped_eyes_have_a_negative_disparity_and_no_size() -> None:
    swapped = (GOOD[1], GOOD[0])
    assert tag_disparity_px(swapped) < 0
    assert tag_size_error(swapped, CAMERA) is None


@pytest.mark.parametrize("shift_px", [-1.5, 0.0, 0.8])
def test_turned_eyes_show_as_different_rows(shift_px: float) -> None:
    match = (seen(17, 5.0), seen(17, -55.0, shift_px))
    assert row_disagreement_px(match) == pytest.approx(abs(shift_px), abs=1e-9)
