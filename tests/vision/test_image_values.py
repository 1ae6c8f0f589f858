"""What regions, masks, ellipses and calibrations of one image say about each other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcam.images.pixels import BAYER_CELLS, mosaic
from fieldcam.values import Calibration, DisparityWindow, Ellipse, Mask, PixelFormat, Region

WHOLE = Region.whole(12, 9)
CAMERA = Calibration(1440, 1080, 1700.0, 720.0, 540.0, 60.0)


@st.composite
def regions(draw: st.DrawFn) -> Region:
    x0, y0 = draw(st.integers(-5, 12)), draw(st.integers(-5, 9))
    return Region(x0, y0, x0 + draw(st.integers(0, 8)), y0 + draw(st.integers(0, 8)))


@st.composite
def masks(draw: st.DrawFn) -> Mask:
    region = draw(regions())
    bits = draw(st.integers(0, 2**64 - 1))
    window = np.array([bits >> k & 1 for k in range(region.width * region.height)], np.bool_)
    return Mask(region.x0, region.y0, window.reshape(region.height, region.width))


def pixels(region: Region) -> set[tuple[int, int]]:
    return {(x, y) for x in range(region.x0, region.x1) for y in range(region.y0, region.y1)}


def drawn(mask: Mask) -> set[tuple[int, int]]:
    return {(int(x) + mask.x0, int(y) + mask.y0) for y, x in np.argwhere(mask.window)}


@given(regions(), regions())
def test_an_overlap_holds_the_pixels_of_both(one: Region, two: Region) -> None:
    shared = one.overlap(two)
    assert pixels(shared) == pixels(one) & pixels(two)
    inner = Mask(one.x0, one.y0, np.zeros((one.height, one.width), np.bool_))
    inner.window[shared.slices_in(one)] = True
    assert drawn(inner) == pixels(shared)


@given(masks(), masks(), regions())
def test_masks_share_what_both_hold(one: Mask, two: Mask, region: Region) -> None:
    both = drawn(one) & drawn(two)
    assert one.shared_px(two) == two.shared_px(one) == len(both)
    assert one.iou(two) == (len(both) / len(drawn(one) | drawn(two)) if both else 0.0)
    seen = Mask(region.x0, region.y0, one.over(region))
    assert drawn(seen) == drawn(one) & pixels(region)


@given(masks())
def test_a_tight_mask_holds_the_same_pixels(mask: Mask) -> None:
    tight = mask.tight
    assert drawn(tight) == drawn(mask)
    if mask.area_px:
        assert tight.window[[0, -1]].any(axis=1).all()
        assert tight.window[:, [0, -1]].any(axis=0).all()
        assert mask.center_px == pytest.approx(np.mean(list(drawn(mask)), axis=0))


@given(regions())
def test_disparity_is_unknown_where_it_was_not_searched(wanted: Region) -> None:
    window = DisparityWindow(WHOLE, np.arange(108, dtype=np.float32).reshape(9, 12))
    found = window.over(wanted)
    for x, y in pixels(wanted):
        value = found[y - wanted.y0, x - wanted.x0]
        assert value == 12 * y + x if (x, y) in pixels(WHOLE) else np.isnan(value)


def test_points_of_an_ellipse_lie_on_it() -> None:
    ellipse = Ellipse((30.0, 20.0), 10.0, 6.0, 0.7)
    offset = ellipse.points_px(500) - ellipse.center_px
    along = offset @ [np.cos(0.7), np.sin(0.7)]
    across = offset @ [-np.sin(0.7), np.cos(0.7)]
    assert np.hypot(along / 5, across / 3) == pytest.approx(1)
    x, y = offset.T
    around = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2
    assert around == pytest.approx(ellipse.area_px, rel=1e-3)


@given(st.floats(0, 1439), st.floats(0, 1079), st.floats(100, 2000))
def test_a_place_and_its_range_are_a_point(x: float, y: float, range_mm: float) -> None:
    point = CAMERA.points_mm(np.array([x, y]), np.array(range_mm))
    assert point[2] == range_mm
    assert CAMERA.places_px(point) == pytest.approx([x, y], abs=1e-6)
    aside = CAMERA.places_px(point + np.eye(3)[0]) - CAMERA.places_px(point)
    assert aside == pytest.approx([CAMERA.px_per_mm(range_mm), 0], abs=1e-6)


@pytest.mark.parametrize("pixel_format", list(BAYER_CELLS))
def test_a_mosaic_keeps_each_colour_where_its_filter_is(pixel_format: PixelFormat) -> None:
    colours = mosaic(np.full((4, 6, 3), (10, 20, 30), np.uint8), pixel_format)
    assert (colours[:2, 2:4] == colours[2:, :2]).all()
    named = pixel_format.value.removeprefix("bayer_").removesuffix("8")
    first = {"r": 10, "g": 20, "b": 30}
    assert colours[0, :2].tolist() == [first[letter] for letter in named]
