"""Disparity of a rectified pair, for a region or the whole image.

There is one operation: match a left crop with a right crop that was taken
`offset_px` further left, inside a bounded window. A disparity outside the
window is NaN, never a value at the window's edge.
"""

from __future__ import annotations

import math
from typing import Protocol, Self

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import DisparityWindow, FloatMap, ImageU8, Region, StereoPair

TILE_PX = 512
TILE_OVERLAP_PX = 64
MIN_LAYER_SHARE = 0.01
"""A depth layer with fewer of a tile's pixels is left as the coarse pass saw it."""


class StereoMatcher(Protocol):
    """What finds disparity in a bounded window around zero."""

    @property
    def search_px(self) -> float:
        """Largest absolute disparity that can come out, in pixels of the crops."""
        ...

    @property
    def scale(self) -> float:
        """Resolution at which the matcher works, relative to the crops."""
        ...

    def match(self, left: ImageU8, right: ImageU8) -> FloatMap:
        """Residual disparity (H, W) of two crops of one size; NaN where unknown."""
        ...

    def spanning(self, search_px: float) -> Self:
        """The same matcher with another window, at the resolution that this takes."""
        ...


def default_max_disparity(width_px: int) -> int:
    """Bound of the search where none is given: a quarter of the width, 0.29 m for the camera."""
    return max(64, width_px // 4)


def match_region(
    pair: StereoPair, region: Region, offset_px: int, matcher: StereoMatcher
) -> DisparityWindow:
    """Disparity of one region of the left image, searched around an offset."""
    left = pair.left[region.slices]
    residual = matcher.match(left, right_crop(pair.right, region, offset_px))
    disparity = residual + np.float32(offset_px)
    columns = np.arange(region.x0, region.x1, dtype=np.float32)[None, :] - disparity
    inside = (columns > -0.5) & (columns < pair.right.shape[1] - 0.5) & (disparity > 0)
    return DisparityWindow(region, np.where(inside, disparity, np.nan).astype(np.float32))


def right_crop(right: ImageU8, region: Region, offset_px: int) -> ImageU8:
    """The right image's part that lies `offset_px` left of a region, border pixels repeated.

    (region.height, region.width, 3), or without colours (region.height, region.width).
    """
    columns = np.arange(region.x0, region.x1) - offset_px
    rows = right[region.y0 : region.y1]
    return np.ascontiguousarray(rows[:, np.clip(columns, 0, right.shape[1] - 1)])


def match_coarse(pair: StereoPair, matcher: StereoMatcher, max_disparity: int) -> DisparityWindow:
    """Disparity of the whole image between 0 and a bound, in one pass."""
    width, height = pair.size_px
    half = math.ceil(max_disparity / 2)
    found = match_region(pair, Region.whole(width, height), half, matcher.spanning(half))
    disparity = found.disparity_px
    bounded = np.where(disparity <= max_disparity, disparity, np.nan).astype(np.float32)
    return DisparityWindow(found.region, bounded)


def match_whole(
    pair: StereoPair, matcher: StereoMatcher, max_disparity: int, likely_px: int | None = None
) -> DisparityWindow:
    """Disparity of the whole image: a coarse pass, then tiles at the matcher's own resolution.

    The tiles are left out where the first pass ran at that resolution already,
    as it does for SGBM and for a small bound. Around `likely_px`, the disparity
    of what matters, the tiles are matched whatever the coarse pass says: things
    of the size of a fruitlet are too small for it.
    """
    coarse = match_coarse(pair, matcher, max_disparity)
    if matcher.spanning(max_disparity / 2).scale >= matcher.scale:
        return coarse
    refined = coarse.disparity_px.copy()
    for tile in _tiles(*pair.size_px):
        inner, disparity = _refine(pair, tile, coarse, matcher, likely_px)
        better = disparity[inner.slices_in(tile)]
        known = np.isfinite(better) & (better <= max_disparity)
        refined[inner.slices][known] = better[known]
    return DisparityWindow(coarse.region, refined)


def _refine(
    pair: StereoPair,
    tile: Region,
    coarse: DisparityWindow,
    matcher: StereoMatcher,
    likely_px: int | None,
) -> tuple[Region, FloatMap]:
    """One tile's disparity: each depth layer is matched at its own offset."""
    guess = coarse.disparity_px[tile.slices]
    refined = np.full_like(guess, np.nan)
    if likely_px is not None:
        refined = match_region(pair, tile, likely_px, matcher).disparity_px.copy()
    for offset in _layers(guess, matcher.search_px):
        near = np.abs(guess - offset) <= matcher.search_px
        found = match_region(pair, tile, offset, matcher).disparity_px
        # A layer speaks only for pixels that the coarse pass puts near it.
        best = near & (np.abs(found - guess) < 0.25 * matcher.search_px)
        refined[best & np.isnan(refined)] = found[best & np.isnan(refined)]
    return _inner(tile, *pair.size_px), refined


def _layers(guess: FloatMap, search_px: float) -> list[int]:
    """Offsets whose windows cover a tile's coarse disparities, most common first."""
    known = guess[np.isfinite(guess)]
    least = max(1, round(MIN_LAYER_SHARE * guess.size))
    offsets: list[int] = []
    while known.size >= least:
        offset = round(float(np.median(known)))
        offsets.append(offset)
        remaining = known[np.abs(known - offset) > 0.75 * search_px]
        if remaining.size == known.size:
            # The median fell into a gap between two layers: take the nearer one.
            offsets[-1] = offset = round(float(known.max()))
            remaining = known[np.abs(known - offset) > 0.75 * search_px]
        known = remaining
    return offsets


def _tiles(width: int, height: int) -> list[Region]:
    return [
        Region(x, y, min(x + TILE_PX, width), min(y + TILE_PX, height))
        for y in _starts(height)
        for x in _starts(width)
    ]


def _starts(length: int) -> list[int]:
    step = TILE_PX - TILE_OVERLAP_PX
    last = max(length - TILE_PX, 0)
    return [*range(0, last, step), last]


def _inner(tile: Region, width: int, height: int) -> Region:
    """A tile without the half of its overlap, save at the image's border."""
    margin = TILE_OVERLAP_PX // 2
    return Region(
        tile.x0 + margin * (tile.x0 > 0),
        tile.y0 + margin * (tile.y0 > 0),
        tile.x1 - margin * (tile.x1 < width),
        tile.y1 - margin * (tile.y1 < height),
    )


def resized(image: npt.NDArray[np.uint8], size: tuple[int, int]) -> ImageU8:
    """An image at another (width, height): area average down, cubic up."""
    down = size[0] <= image.shape[1]
    way = cv2.INTER_AREA if down else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(image, size, interpolation=way), dtype=np.uint8)
