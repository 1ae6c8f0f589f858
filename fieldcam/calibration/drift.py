"""Signs that a calibration no longer fits its camera, read off a tag of known size.

A printed tag is the one thing of known size in the picture, and both eyes see
it: a wrong side length means a wrong baseline or focal length, corners on
different rows mean that the eyes have turned against each other.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldcam.values import TAG_SIZE_MM, Calibration, TagPose

Corners = npt.NDArray[np.float64]

TAG_SIZE_BIAS = -0.0055
"""White grows into black by the camera's gamma, also with a perfect calibration."""
BLEEDING = 0.015
"""How much farther it grows in bright or soft pictures; the tag then looks smaller."""
DRIFT_SIZE = 0.02
"""A size that is farther off is no accident; those of fruitlets are off by as much."""

TagMatch = tuple[TagPose, TagPose]
"""The same tag in the left and in the right image."""


def tag_disparity_px(match: TagMatch) -> float:
    """Mean disparity of the tag's corners; negative where the eyes are swapped."""
    left, right = _corners(match[0]), _corners(match[1])
    return float((left - right)[:, 0].mean())


def measured_tag_size_mm(match: TagMatch, calibration: Calibration) -> float | None:
    """Mean side of the tag by triangulation; None where a corner has no depth."""
    left, right = _corners(match[0]), _corners(match[1])
    disparity_px = left[:, 0] - right[:, 0]
    if (disparity_px <= 0).any():
        return None
    points_mm = calibration.points_mm(left, calibration.range_mm(disparity_px))
    sides_mm = np.linalg.norm(points_mm - np.roll(points_mm, 1, axis=0), axis=1)
    return float(sides_mm.mean())


def tag_size_error(
    match: TagMatch, calibration: Calibration, tag_size_mm: float = TAG_SIZE_MM
) -> float | None:
    """(measured - printed) / printed side; None where a corner has no depth.

    A camera with a gamma curve makes white grow into black: on rendered pairs
    with gamma 1.7 to 2.4 a good calibration gives -0.006 to -0.005, not 0.
    """
    measured_mm = measured_tag_size_mm(match, calibration)
    return None if measured_mm is None else measured_mm / tag_size_mm - 1.0


def unbiased(size_error: float) -> float:
    """The same less what white growing into black explains: how far calibration or card is off.

    A card that calipers have measured agrees with this, not with the error as it is.
    """
    return size_error - TAG_SIZE_BIAS


def size_off(size_error: float | None) -> float:
    """How far the tag's triangulated size is off, less what bleeding light explains."""
    if size_error is None:
        return 1.0
    off = unbiased(size_error)
    return off if off > 0 else max(-off - BLEEDING, 0.0)


def row_disagreement_px(match: TagMatch) -> float:
    """Median |y_left - y_right| over the corners."""
    left, right = _corners(match[0]), _corners(match[1])
    return float(np.median(np.abs(left - right)[:, 1]))


def _corners(tag: TagPose) -> Corners:
    """(4, 2) float64, px."""
    return np.array(tag.corners_px, dtype=np.float64)
