"""Measures light, sharpness, depth and the eyes' agreement of one pair."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from fieldcam.vision.judging.evidence import Quality
from fieldcam.vision.judging.eye_matches import match_eyes
from fieldcam.vision.judging.sharpness import edge_blur_px, tag_blur_px
from fieldcam.vision.stereo.matching import gray

from fieldcam.values import (
    DisparityWindow,
    Fruitlet,
    ImageU8,
    Region,
    StereoPair,
    TagPose,
)
from fieldcam.vision.clouds import cut

CLIPPED = 250
LIT = 100
"""Grey that what the flash reaches has in a good picture, and a night sky has not."""
WHITE_QUANTILE = 0.95
SEEN = 15
"""Grey levels between dark and light of a picture that shows something."""
MIDDLE = 0.6
"""Share of the image's sides that counts where no tag says where to look."""


def measure_quality(
    pair: StereoPair,
    region: Region,
    tag: TagPose | None,
    window: DisparityWindow,
    fruitlets: tuple[Fruitlet, ...],
) -> Quality:
    """All measures of a pair; `region` is what was searched for fruitlets."""
    left, right = gray(pair.left), gray(pair.right)
    looked_at = middle(*pair.size_px) if tag is None else region
    around = left[looked_at.slices]
    fruit = _fruit_pixels(left, fruitlets) if fruitlets else None
    tag_blur = None if tag is None else tag_blur_px(left, tag)
    return Quality(
        fruit_brightness=None if fruit is None else float(np.median(fruit)),
        white_level=white_level(around),
        right_white_ratio=white_level(right) / max(white_level(left), 1.0),
        clipped_share=clipped_share(around[around >= LIT] if fruit is None else fruit),
        tag_blur_px=tag_blur,
        edge_blur_px=_edge_blur_px(around) if tag_blur is None else None,
        depth_share=_depth_share(window, fruitlets),
        eyes=match_eyes(left, right, looked_at),
    )


def _edge_blur_px(around: ImageU8) -> float | None:
    """Infinite where light and dark flow into each other without an edge."""
    found = edge_blur_px(around)
    if found is not None:
        return found
    dark, light = np.quantile(around, (1 - WHITE_QUANTILE, WHITE_QUANTILE))
    return math.inf if light - dark >= SEEN else None


def middle(width_px: int, height_px: int) -> Region:
    """The middle of an image, where an operator puts what matters."""
    x, y = (round(side * (1 - MIDDLE) / 2) for side in (width_px, height_px))
    return Region(x, y, width_px - x, height_px - y)


def white_level(grey: ImageU8) -> float:
    """Grey that 5 % of the pixels reach."""
    counts = np.cumsum(np.bincount(grey.ravel(), minlength=256))
    return float(np.searchsorted(counts, WHITE_QUANTILE * counts[-1]))


def clipped_share(grey: npt.NDArray[np.uint8]) -> float:
    """Share of pixels at the top of the scale."""
    return float((grey >= CLIPPED).mean()) if grey.size else 0.0


def _depth_share(window: DisparityWindow, fruitlets: tuple[Fruitlet, ...]) -> float:
    depths = [cut(window, f.mask.region)[f.mask.window] for f in fruitlets]
    return float(np.isfinite(np.concatenate(depths)).mean()) if depths else 0.0


def _fruit_pixels(image: ImageU8, fruitlets: tuple[Fruitlet, ...]) -> npt.NDArray[np.uint8]:
    parts = [image[f.mask.region.slices][f.mask.window] for f in fruitlets]
    return np.concatenate(parts)
