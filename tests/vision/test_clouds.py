"""Point clouds of drawn fruitlets, with holes, edges and false depths."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_fruit import CAMERA, Fruit, draw

from fieldcam.values import Calibration, DisparityWindow, Mask, Region
from fieldcam.vision.clouds import (
    PAPER_CLOUDS,
    CloudParameters,
    back_project,
    bilateral,
    depth_edges,
    fruitlet_cloud,
    thinned,
)

FRUIT = Fruit((12.0, -8.0, 440.0), 12.0)
PARAMETERS = CloudParameters()


def test_a_cloud_lies_on_the_near_side_of_its_fruitlet() -> None:
    drawn = draw([FRUIT])
    cloud = fruitlet_cloud(drawn.instances[0].visible, drawn.window, CAMERA)
    assert cloud.centroid_mm is not None
    assert cloud.centroid_mm == pytest.approx((12.0, -8.0, 440.0 - 0.7 * 6), abs=0.4)
    from_center = np.linalg.norm(cloud.points_mm - np.array(FRUIT.center_mm), axis=1)
    assert np.median(np.abs(from_center - 6.0)) < 0.2
    assert cloud.points_mm.dtype == np.float32


def test_unknown_pixels_stay_unknown_and_do_not_bend_their_neighbours() -> None:
    disparity = np.full((40, 40), 230.0, np.float32)
    disparity[10:20, 10:20] = np.nan
    smooth = bilateral(disparity, PARAMETERS)
    assert (np.isnan(smooth) == np.isnan(disparity)).all()
    np.testing.assert_allclose(smooth[np.isfinite(smooth)], 230.0, atol=0.01)


def test_the_bilateral_filter_takes_noise_off_and_keeps_a_step() -> None:
    rng = np.random.default_rng(0)
    disparity = np.full((60, 60), 230.0)
    disparity[:, 30:] = 240.0
    noisy = (disparity + rng.normal(0, 0.4, disparity.shape)).astype(np.float32)
    smooth = bilateral(noisy, PARAMETERS)
    assert np.abs(smooth - disparity).std() < 0.15
    assert np.abs(smooth[:, 29:31] - disparity[:, 29:31]).max() < 1.0


@pytest.mark.parametrize(("step_px", "found"), [(0.5, False), (3.0, True)])
def test_depth_edges_are_jumps_of_more_than_four_thousandths(step_px: float, found: bool) -> None:
    disparity = np.full((20, 20), 235.0, np.float32)
    disparity[:, 10:] += step_px
    disparity[:, 0] = np.nan
    edges = depth_edges(disparity, PARAMETERS.jump_ratio)
    assert edges[:, 9:11].all() == found
    assert not edges[:, :7].any()


def plane(disparity_px: float, side: int = 30) -> tuple[Mask, DisparityWindow]:
    mask = Mask(600, 500, np.ones((side, side), np.bool_))
    values = np.full((side + 20, side + 20), disparity_px, np.float32)
    return mask, DisparityWindow(Region(590, 490, 610 + side, 510 + side), values)


def test_too_few_points_make_no_cloud() -> None:
    mask, window = plane(230.0, side=7)
    assert fruitlet_cloud(mask, window, CAMERA).centroid_mm is None
    mask, window = plane(230.0, side=12)
    assert fruitlet_cloud(mask, window, CAMERA).centroid_mm is not None


def test_points_far_from_the_median_are_dropped() -> None:
    mask, window = plane(230.0)
    window.disparity_px[10:18, 10:40] = 150.0
    cloud = fruitlet_cloud(mask, window, CAMERA)
    assert np.ptp(cloud.points_mm[:, 2]) < 5
    assert not cloud.known[:6].any()


def test_a_cloud_smeared_along_the_line_of_sight_is_inconsistent() -> None:
    mask, window = plane(230.0)
    ramp = np.linspace(224.0, 236.0, 50, dtype=np.float32)
    window.disparity_px[:] = ramp[:, None]
    assert fruitlet_cloud(mask, window, CAMERA, PAPER_CLOUDS).centroid_mm is None
    assert fruitlet_cloud(mask, window, CAMERA).centroid_mm is not None
    window.disparity_px[:] = np.linspace(205.0, 255.0, 50, dtype=np.float32)[:, None]
    assert fruitlet_cloud(mask, window, CAMERA).centroid_mm is None


def test_a_mask_outside_the_searched_window_has_no_points() -> None:
    mask, _ = plane(230.0)
    window = DisparityWindow(Region(0, 0, 50, 50), np.full((50, 50), 200.0, np.float32))
    cloud = fruitlet_cloud(mask, window, CAMERA)
    assert cloud.centroid_mm is None
    assert cloud.points_mm.shape == (0, 3)
    assert np.isnan(window.over(Region(40, 40, 60, 60))[10:, 10:]).all()


def test_back_projection_inverts_projection() -> None:
    camera = Calibration(200, 100, 1000.0, 90.0, 40.0, 60.0)
    disparity = np.full((2, 3), np.nan, np.float32)
    disparity[1, 2] = 150.0
    points, (rows, columns) = back_project(disparity, Region(20, 10, 23, 12), camera)
    assert (rows.tolist(), columns.tolist()) == ([1], [2])
    x, y, z = points[0]
    assert z == pytest.approx(400.0)
    assert 1000.0 * x / z + 90.0 == pytest.approx(22.0)
    assert 1000.0 * y / z + 40.0 == pytest.approx(11.0)


def test_thinning_leaves_one_point_to_a_cell() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(-5, 5, (4000, 3)).astype(np.float32)
    few = thinned(points, 1.0)
    cells = np.floor(few).astype(int)
    assert len(np.unique(cells, axis=0)) == len(few) <= 1000
    assert len(thinned(few, 1.0)) == len(few)
