"""Diameters of drawn fruitlets: exact geometry, each correction, and when to stay silent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from drawn_fruit import CAMERA, Drawn, Fruit, draw

from fieldcam.values import DisparityWindow, Flag, Region
from fieldcam.vision.clouds import fruitlet_cloud
from fieldcam.vision.segmentation import is_cut
from fieldcam.vision.sizing.covers import covers
from fieldcam.vision.sizing.diameters import (
    Observation,
    SizedOutline,
    size_by_paper,
    size_fruitlet,
)
from fieldcam.vision.sizing.parameters import Corrections, SizingParameters, Uncertainty


def observations(drawn: Drawn) -> list[Observation]:
    clouds = [fruitlet_cloud(i.visible, drawn.window, CAMERA) for i in drawn.instances]
    before = covers(drawn.instances, clouds, drawn.window, CAMERA)
    return [
        Observation(i, drawn.window, c.known, b, is_cut(i, drawn.window.region))
        for i, c, b in zip(drawn.instances, clouds, before, strict=True)
    ]


def sizes(drawn: Drawn) -> list[SizedOutline]:
    return [size_fruitlet(o, CAMERA) for o in observations(drawn)]


def scattered(count: int, seed: int = 0) -> list[Fruit]:
    """Fruitlets all over the image and the working range, none over another."""
    rng = np.random.default_rng(seed)
    fruits = []
    for k in range(count):
        z = rng.uniform(360, 520)
        column, row = 120 + 240 * (k % 6), 150 + 250 * (k // 6 % 4)
        x, y = (column - CAMERA.cx_px) * z / CAMERA.focal_px, (row - CAMERA.cy_px) * z / 1717
        axis = rng.normal(size=3)
        fruits.append(
            Fruit(
                (x, y, z), rng.uniform(5, 18), rng.uniform(1, 1.2),
                (float(axis[0]), float(axis[1]), float(axis[2])),
            )
        )  # fmt: skip
    return fruits


def errors(fruits: Sequence[Fruit], results: Sequence[SizedOutline]) -> list[float]:
    assert all(r.diameter_mm is not None for r in results)
    return [
        r.diameter_mm - f.diameter_mm
        for f, r in zip(fruits, results, strict=True)
        if r.diameter_mm is not None
    ]


def test_perfect_masks_and_depths_give_the_diameter_anywhere_in_the_image() -> None:
    fruits = scattered(12)
    found = errors(fruits, sizes(draw(fruits)))
    assert abs(np.mean(found)) < 0.02
    assert np.abs(found).max() < 0.12


def test_the_papers_formula_is_short_by_the_pixel_contour_and_the_depth() -> None:
    fruits = scattered(12)
    found = errors(fruits, [size_by_paper(o, CAMERA) for o in observations(draw(fruits))])
    # 0.9 px of contour at 0.26 mm, and 0.7 radii of depth.
    assert -0.4 < np.mean(found) < -0.15


@pytest.mark.parametrize("name", ["subpixel", "center_depth", "perspective"])
def test_each_correction_takes_error_away(name: str) -> None:
    fruits = scattered(12, seed=3)
    observed = observations(draw(fruits))
    full = errors(fruits, [size_fruitlet(o, CAMERA) for o in observed])
    without = replace(Corrections(), **{name: False})
    less = errors(fruits, [size_fruitlet(o, CAMERA, corrections=without) for o in observed])
    assert np.abs(less).mean() > 2 * np.abs(full).mean()


def test_only_own_edges_are_fitted() -> None:
    fruit = Fruit((0.0, 0.0, 440.0), 12.0)
    covered = draw([fruit], covers=[(Region(640, 400, 692, 600), 400.0)])
    assert covered.visible_fraction[0] == pytest.approx(0.7, abs=0.1)
    observed = observations(covered)[0]
    assert size_fruitlet(observed, CAMERA).diameter_mm == pytest.approx(12.0, abs=0.2)
    # The robust fit finds out by itself here, so it is left out.
    plain = replace(Corrections(), robust=False)
    seeing = size_fruitlet(observed, CAMERA, corrections=plain)
    blind = size_fruitlet(observed, CAMERA, corrections=replace(plain, own_edge=False))
    assert seeing.diameter_mm == pytest.approx(12.0, abs=0.2)
    assert blind.diameter_mm is None or abs(blind.diameter_mm - 12.0) > 0.5


def test_a_fruitlet_partly_behind_another_keeps_its_size() -> None:
    fruits = [Fruit((0.0, 0.0, 430.0), 12.0), Fruit((8.0, 3.0, 442.0), 11.0)]
    drawn = draw(fruits)
    assert 0.5 < drawn.visible_fraction[1] < 0.9
    found = errors(fruits, sizes(drawn))
    assert np.abs(found).max() < 0.2


def test_the_edge_bias_of_a_network_is_taken_off() -> None:
    fruit = Fruit((0.0, 0.0, 440.0), 12.0)
    observed = observations(draw([fruit]))[0]
    biased = SizingParameters(edge_bias_px=1.0)
    expected = 12.0 - 2.0 * 440.0 / CAMERA.focal_px
    assert size_fruitlet(observed, CAMERA, biased).diameter_mm == pytest.approx(expected, abs=0.05)


def mostly_hidden() -> Drawn:
    """An eighth of a fruitlet beside a cover."""
    fruit = Fruit((0.0, 0.0, 440.0), 14.0)
    return draw([fruit], covers=[(Region(640, 400, 715, 600), 400.0)])


def without_depth() -> Drawn:
    drawn = draw([Fruit((0.0, 0.0, 440.0), 12.0)])
    unknown = np.full_like(drawn.window.disparity_px, np.nan)
    return replace(drawn, window=DisparityWindow(drawn.window.region, unknown))


def at_the_border() -> Drawn:
    return draw([Fruit(((3 - CAMERA.cx_px) * 440 / CAMERA.focal_px, 0.0, 440.0), 12.0)])


def a_leaf() -> Drawn:
    return draw([Fruit((0.0, 0.0, 440.0), 9.0, elongation=2.5, axis=(1.0, 1.0, 0.0))])


def giant() -> Drawn:
    return draw([Fruit((0.0, 0.0, 440.0), 60.0)])


@pytest.mark.parametrize(
    ("drawn", "flag"),
    [
        (mostly_hidden, Flag.HIDDEN),
        (without_depth, Flag.NO_DEPTH),
        (at_the_border, Flag.CUT_BY_BORDER),
        (a_leaf, Flag.BAD_OUTLINE),
        (giant, Flag.OUTLIER),
    ],
)
def test_no_size_beats_a_wrong_one(drawn: object, flag: Flag) -> None:
    assert callable(drawn)
    scene: Drawn = drawn()
    (result,) = sizes(scene)
    assert result.diameter_mm is None
    assert flag in result.flags


def test_visible_fraction_is_that_of_the_whole_outline() -> None:
    drawn = draw([Fruit((0.0, 0.0, 440.0), 12.0)], covers=[(Region(640, 400, 692, 600), 400.0)])
    (result,) = sizes(drawn)
    assert result.visible_fraction == pytest.approx(drawn.visible_fraction[0], abs=0.04)


def test_a_detection_that_the_network_is_unsure_of_is_seen_but_not_sized() -> None:
    drawn = draw([Fruit((0.0, 0.0, 440.0), 12.0)])
    (observed,) = observations(drawn)
    unsure = replace(observed, instance=replace(observed.instance, score=0.8))
    assert size_fruitlet(unsure, CAMERA).diameter_mm is None
    assert Flag.BAD_OUTLINE in size_fruitlet(unsure, CAMERA).flags
    assert size_fruitlet(observed, CAMERA).diameter_mm is not None


def test_the_parts_of_an_uncertainty_add_as_squares() -> None:
    uncertainty = Uncertainty(of_outline=2.0, of_width=1.0, least_mm=0.03, of_diameter=0.004)
    assert uncertainty.sd_mm(10.0, 0.06, 0.0) == pytest.approx(0.13)
    assert uncertainty.sd_mm(10.0, 0.0, 0.012) == pytest.approx(0.13)
    assert uncertainty.sd_mm(10.0, 0.0, None) == pytest.approx(0.05)


def test_a_size_that_the_network_is_unsure_of_is_not_given_out() -> None:
    sure = observations(draw([Fruit((0.0, 0.0, 440.0), 9.0)]))[0]
    parameters = SizingParameters(uncertainty=Uncertainty(of_width=1.0))
    unsure = replace(sure, instance=replace(sure.instance, width_sd=0.2, seen_fraction=0.5))
    size = size_fruitlet(sure, CAMERA, parameters)
    assert size.diameter_mm is not None
    assert size.sd_mm is not None
    assert size.sd_mm < 0.3
    doubtful = size_fruitlet(unsure, CAMERA, parameters)
    assert doubtful.diameter_mm is None
    assert doubtful.flags == (Flag.HIDDEN,)
    assert doubtful.visible_fraction == 0.5
