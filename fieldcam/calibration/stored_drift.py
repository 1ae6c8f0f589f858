"""The size of the printed tag, read off readings that were stored.

A reading holds the tag as the left eye saw it and the disparity around it. The
tag's pose says how far away a tag of the printed size would be, the disparity how
far it is: their ratio is the size that this camera measures. White grows into black,
so on 18 good rendered pairs it came out 0.1 to 0.9 % too small.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median

import numpy as np
import numpy.typing as npt

from fieldcam.values import TAG_SIZE_MM, BoolMask, ClusterReading, DisparityWindow, TagPose

SIZE_BIAS = -0.005
"""Of the measured size with a perfect calibration: medians of nine were -0.0043, -0.0054."""
DRIFT = 0.01
"""A median farther from that is no accident; sizes of fruitlets are off by as much."""
LEAST_PICTURES = 3
LEAST_PIXELS = 100
INNER = 0.85
"""Of the tag's side: at its border the disparity belongs half to what is behind it."""


@dataclass(frozen=True, slots=True)
class TagSizes:
    """What the last pictures say about the camera's calibration."""

    errors: tuple[float, ...]
    """(measured - printed) / printed side, one for each picture that tells."""

    @property
    def measured_mm(self) -> float | None:
        """Median side of a tag that is printed at 27.95 mm; None without a picture."""
        return TAG_SIZE_MM * (1 + median(self.errors)) if self.errors else None

    @property
    def drift(self) -> float | None:
        """How far it is off, less the bias; None where too few pictures tell."""
        if len(self.errors) < LEAST_PICTURES:
            return None
        return median(self.errors) - SIZE_BIAS

    @property
    def drifted(self) -> bool:
        return self.drift is not None and abs(self.drift) > DRIFT


def tag_sizes(readings: Iterable[ClusterReading]) -> TagSizes:
    """The check over some readings."""
    found = (tag_size_error(reading) for reading in readings)
    return TagSizes(tuple(error for error in found if error is not None))


def tag_size_error(reading: ClusterReading) -> float | None:
    """(measured - printed) / printed side; None where tag or disparity is missing."""
    tag, window, camera = reading.tag, reading.window, reading.calibration
    if tag is None or window is None or tag.translation_mm is None or tag.rotation is None:
        return None
    region = window.region
    y, x = np.mgrid[region.y0 : region.y1, region.x0 : region.x1]
    known = inside(tag, x, y) & _positive(window)
    if known.sum() < LEAST_PIXELS:
        return None
    rays = np.stack(
        (
            (x[known] - camera.cx_px) / camera.focal_px,
            (y[known] - camera.cy_px) / camera.focal_px,
            np.ones(known.sum()),
        )
    )
    normal = np.array(tag.rotation)[:, 2]
    range_mm = (normal @ np.array(tag.translation_mm)) / (normal @ rays)
    expected_px = camera.focal_px * camera.baseline_mm / range_mm
    return float(np.median(expected_px / window.disparity_px[known])) - 1


def inside(tag: TagPose, x: npt.NDArray[np.int_], y: npt.NDArray[np.int_]) -> BoolMask:
    """Which pixels lie well inside the tag; its corners may run either way round."""
    corners = np.array(tag.corners_px)
    middle = corners.mean(axis=0)
    inner = middle + (corners - middle) * INNER
    sides = [
        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        for a, b in zip(inner, np.roll(inner, -1, axis=0), strict=True)
    ]
    within: BoolMask = np.all([s >= 0 for s in sides], axis=0)
    other: BoolMask = np.all([s <= 0 for s in sides], axis=0)
    return within | other


def _positive(window: DisparityWindow) -> BoolMask:
    with np.errstate(invalid="ignore"):
        return window.disparity_px > 0
