"""Stereo on pairs whose disparity is known: offsets, bounds, borders, resolution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from fieldcam.values import FloatMap, ImageU8, Region, StereoPair
from fieldcam.vision.stereo.matching import (
    match_coarse,
    match_region,
    match_whole,
    resized,
    right_crop,
)
from fieldcam.vision.stereo.raft import RaftMatcher, enlarged
from fieldcam.vision.stereo.sgbm import SgbmMatcher

Array = npt.NDArray[Any]


def dotted_pair(disparity: Array) -> StereoPair:
    """A pair of random texture whose left eye has this whole-pixel disparity (H, W)."""
    height, width = disparity.shape
    rng = np.random.default_rng(4)
    left, right = _texture(rng, height, width), _texture(rng, height, width)
    columns = np.arange(width)[None, :] - disparity
    for value in np.unique(disparity):  # nearer surfaces are painted last
        rows, sources = np.nonzero((disparity == value) & (columns >= 0))
        right[rows, sources - value] = left[rows, sources]
    return StereoPair(_rgb(left), _rgb(right))


def _texture(rng: np.random.Generator, height: int, width: int) -> ImageU8:
    """(height, width) random texture with as much at coarse as at fine scales."""
    total = np.zeros((height, width))
    for blur_px in (0.8, 2.0, 5.0):
        layer = cv2.GaussianBlur(rng.normal(size=(height, width)), (0, 0), blur_px)
        total += layer / layer.std()
    return np.clip(128 + 35 * total, 0, 255).astype(np.uint8)


def _rgb(gray: Array) -> ImageU8:
    return np.repeat(gray[..., None], 3, axis=2).astype(np.uint8)


def step(near: int, far: int, shape: tuple[int, int] = (120, 400)) -> npt.NDArray[np.int64]:
    """A near square in front of a far wall."""
    disparity = np.full(shape, far)
    disparity[30:90, 180:330] = near
    return disparity


@pytest.mark.parametrize("offset", [60, 75, 90])
def test_a_region_is_matched_around_any_offset_within_reach(offset: int) -> None:
    truth = step(90, 70)
    region = Region(150, 10, 390, 110)
    window = match_region(dotted_pair(truth), region, offset, SgbmMatcher(32))
    error = np.abs(window.disparity_px - truth[region.slices])
    assert window.disparity_px.dtype == np.float32
    assert np.nanmedian(error) < 0.2
    assert (error < 1).mean() > 0.85


def test_disparities_outside_the_window_are_unknown_not_clamped() -> None:
    truth = step(near=150, far=70)
    region = Region(160, 20, 390, 110)
    found = match_region(dotted_pair(truth), region, 70, SgbmMatcher(24)).disparity_px
    inside = (truth == 150)[region.slices]
    assert np.isnan(found[inside]).mean() > 0.7
    assert np.nanmax(np.abs(found - 70)) <= 24


def test_pixels_whose_match_would_lie_outside_the_right_image_are_unknown() -> None:
    truth = np.full((60, 300), 50)
    found = match_region(dotted_pair(truth), Region(0, 0, 300, 60), 50, SgbmMatcher(16))
    assert np.isnan(found.disparity_px[:, :34]).all()
    assert np.isfinite(found.disparity_px[:, 60:]).mean() > 0.9
    known = np.isfinite(found.disparity_px)
    assert (np.nonzero(known)[1] - found.disparity_px[known] > -0.5).all()


def test_the_right_crop_repeats_the_border_beyond_the_image() -> None:
    right = np.arange(10, dtype=np.uint8)[None, :, None].repeat(3, axis=2).repeat(2, axis=0)
    crop = right_crop(right, Region(1, 0, 6, 2), 4)
    assert crop[0, :, 0].tolist() == [0, 0, 0, 0, 1]


class RampNetwork:
    """Answers with a disparity that is linear in the column, and given confidences."""

    def __init__(self, slope: float, base: float) -> None:
        self.slope, self.base = slope, base
        self.shapes: list[tuple[int, ...]] = []

    def warm_up(self) -> None: ...

    def run(self, inputs: Mapping[str, Array]) -> dict[str, Array]:
        shape = inputs["left"].shape
        self.shapes.append(shape)
        columns = np.arange(shape[3], dtype=np.float32)
        disparity = np.broadcast_to(self.base + self.slope * columns, (1, 1, *shape[2:]))
        confidence = np.where(columns < 20, -1.0, 1.0) * np.ones_like(disparity)
        return {"disparity": disparity.astype(np.float32), "confidence": confidence}


def raft(network: RampNetwork, scale: float = 0.5) -> RaftMatcher:
    return RaftMatcher(network, network_search_px=8, multiple=16, scale=scale)


def test_half_resolution_disparity_comes_back_doubled_and_in_place() -> None:
    network = RampNetwork(slope=0.1, base=-2.0)
    image = np.zeros((50, 120, 3), np.uint8)
    found = raft(network).match(image, image)
    # Half-resolution pixel j covers pixels 2j and 2j + 1, so its centre is at 2j + 1/2.
    columns = np.arange(120)
    expected = 2 * (-2.0 + 0.1 * (columns - 0.5) / 2)
    assert network.shapes == [(1, 3, 32, 64)]
    np.testing.assert_allclose(found[25, 44:116], expected[44:116], atol=1e-4)


def test_unsure_and_out_of_reach_pixels_are_unknown() -> None:
    image = np.zeros((32, 256, 3), np.uint8)
    found = raft(RampNetwork(slope=0.1, base=0.0)).match(image, image)
    assert np.isnan(found[:, :40]).all()  # confidence below zero
    assert np.isfinite(found[:, 42:160]).all()
    assert np.isnan(found[:, 164:]).all()  # residual above 8 network pixels


@pytest.mark.parametrize(("bound", "scale"), [(16, 1.0), (32, 0.5), (64, 0.25), (8, 2.0)])
def test_the_network_works_at_the_resolution_where_its_search_fits(
    bound: float, scale: float
) -> None:
    matcher = raft(RampNetwork(0, 0)).spanning(bound / 2)
    assert matcher.scale == pytest.approx(scale)
    assert matcher.search_px == pytest.approx(bound / 2)


def test_enlarging_keeps_edges_sharp_and_unknown_pixels_unknown() -> None:
    small = np.full((8, 8), 10, np.float32)
    small[:, 4:] = 30
    known = np.ones((8, 8), np.bool_)
    known[0:2] = False
    large = enlarged(small, known, (16, 16))
    assert np.isnan(large[:4]).all()
    assert set(np.unique(large[4:])) == {10.0, 30.0}


class CoarseThenFine(SgbmMatcher):
    """SGBM that works at a lower resolution when asked for a wide window."""

    def __init__(self, search_px: float = 24, shrink: int = 1) -> None:
        super().__init__(search_px / shrink)
        self._shrink = shrink

    @property
    def scale(self) -> float:
        return 1.0 / self._shrink

    @property
    def search_px(self) -> float:
        return self._search_px * self._shrink

    def spanning(self, search_px: float) -> Self:
        return type(self)(search_px, shrink=4 if search_px > 24 else 1)

    def match(self, left: ImageU8, right: ImageU8) -> FloatMap:
        size = left.shape[1] // self._shrink, left.shape[0] // self._shrink
        found = super().match(resized(left, size), resized(right, size))
        return enlarged(found * self._shrink, np.isfinite(found), (left.shape[1], left.shape[0]))


def test_a_whole_image_with_layers_further_apart_than_the_window_is_refined_in_each() -> None:
    truth = step(near=130, far=40, shape=(240, 640))
    pair = dotted_pair(truth)
    whole = match_whole(pair, CoarseThenFine(), 160).disparity_px
    coarse = match_coarse(pair, CoarseThenFine(), 160).disparity_px
    seen = np.arange(640)[None, :] - truth >= 8
    for value in (40, 130):
        at = (truth == value) & seen
        assert (np.abs(whole - truth)[at] < 0.3).mean() > 0.7
        assert (np.abs(whole - truth)[at] < 0.3).mean() > (np.abs(coarse - truth)[at] < 0.3).mean()


class BlindWhenCoarse(CoarseThenFine):
    """Sees nothing at the lower resolution, as a network does of a fruitlet five pixels wide."""

    def match(self, left: ImageU8, right: ImageU8) -> FloatMap:
        found = super().match(left, right)
        return np.full_like(found, np.nan) if self._shrink > 1 else found


def test_the_likely_disparity_is_matched_whatever_the_coarse_pass_saw() -> None:
    truth = step(near=130, far=40, shape=(240, 640))
    pair = dotted_pair(truth)
    assert np.isnan(match_whole(pair, BlindWhenCoarse(), 160).disparity_px).all()
    whole = match_whole(pair, BlindWhenCoarse(), 160, likely_px=135).disparity_px
    at = (truth == 130) & (np.arange(640)[None, :] - truth >= 8)
    assert (np.abs(whole - truth)[at] < 0.3).mean() > 0.7


@pytest.mark.parametrize("bound", [48, 90])
def test_no_disparity_exceeds_the_bound(bound: int) -> None:
    truth = step(near=100, far=30)
    whole = match_whole(dotted_pair(truth), SgbmMatcher(), bound).disparity_px
    assert np.nanmax(whole) <= bound
    assert np.nanmin(whole) > 0
    assert (np.abs(whole - truth)[(truth == 30)] < 1).mean() > 0.5
