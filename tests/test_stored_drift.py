"""The printed tag's size, read off stored readings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_readings import CAMERA, TAG, made_reading

from fieldcam.calibration.stored_drift import SIZE_BIAS, TagSizes, tag_size_error, tag_sizes
from fieldcam.values import TAG_SIZE_MM, ClusterReading, DisparityWindow, Region

SIDE_PX = 760 * TAG_SIZE_MM / 440


def reading(tilt_deg: float = 0.0, scale: float = 1.0) -> ClusterReading:
    """A tag of the printed size 440 mm away, measured by a camera that is off by `scale`."""
    cos, sin = np.cos(np.radians(tilt_deg)), np.sin(np.radians(tilt_deg))
    rotation = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    half = TAG_SIZE_MM / 2
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    points = square @ rotation.T + [10.0, 20.0, 440.0]
    x = CAMERA.cx_px + CAMERA.focal_px * points[:, 0] / points[:, 2]
    y = CAMERA.cy_px + CAMERA.focal_px * points[:, 1] / points[:, 2]
    tag = replace(
        TAG,
        corners_px=tuple(zip(x.tolist(), y.tolist(), strict=True)),
        translation_mm=(10.0, 20.0, 440.0),
        rotation=tuple(tuple(row) for row in rotation.tolist()),
    )
    region = Region(280, 200, 420, 340)
    v, u = np.mgrid[region.y0 : region.y1, region.x0 : region.x1]
    rays = np.stack([(u - CAMERA.cx_px) / 760, (v - CAMERA.cy_px) / 760, np.ones(u.shape)])
    normal = rotation[:, 2]
    range_mm = (normal @ [10.0, 20.0, 440.0]) / np.tensordot(normal, rays, axes=1)
    disparity = (CAMERA.focal_px * CAMERA.baseline_mm / range_mm / scale).astype(np.float32)
    # Behind the tag it is far; the tag's own border is not to be mixed with that.
    inside = (np.abs(u - x.mean()) < SIDE_PX / 2) & (np.abs(v - y.mean()) < SIDE_PX / 2)
    disparity[~inside] = 20.0
    return replace(made_reading(tag=tag), window=DisparityWindow(region, disparity))


@pytest.mark.parametrize("tilt_deg", [0.0, 25.0, -40.0])
@pytest.mark.parametrize("scale", [0.97, 1.0, 1.02])
def test_a_wrong_baseline_shows_in_the_tags_size(tilt_deg: float, scale: float) -> None:
    error = tag_size_error(reading(tilt_deg, scale))
    assert error == pytest.approx(scale - 1, abs=2e-3)


def test_pixels_without_disparity_are_left_out() -> None:
    good = reading()
    assert good.window is not None
    good.window.disparity_px[::2] = np.nan
    assert tag_size_error(good) == pytest.approx(0, abs=2e-3)
    good.window.disparity_px[:] = np.nan
    assert tag_size_error(good) is None


def test_without_a_tag_or_its_pose_nothing_is_said() -> None:
    good = reading()
    assert good.tag is not None
    blind = [
        replace(good, tag=None),
        replace(good, window=None),
        replace(good, tag=replace(good.tag, translation_mm=None)),
    ]
    assert tag_sizes(blind) == TagSizes(())
    assert TagSizes(()).measured_mm is None and TagSizes(()).drift is None


def test_drift_is_told_from_the_median_of_enough_pictures() -> None:
    assert TagSizes((0.05, 0.05)).drift is None and not TagSizes((0.05, 0.05)).drifted
    assert not TagSizes((SIZE_BIAS, SIZE_BIAS, 0.05)).drifted
    assert TagSizes((0.05, 0.04, SIZE_BIAS)).drifted
    assert TagSizes((-0.02, -0.02, -0.02)).drifted
    assert TagSizes((0.0, 0.1, 0.0)).measured_mm == TAG_SIZE_MM
