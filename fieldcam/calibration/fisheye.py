"""Tells a fisheye lens, where the lens model of this package fits badly."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from fieldcam.calibration.boards import Pixels
from fieldcam.calibration.reading.documents import Array

FOCAL_GUESSES = (0.45, 0.3, 0.6)
"""Of the picture's width; the solver finds nothing from a start that is far off."""
BETTER = 0.5
"""By so much must a fisheye lens fit better: of what this package's model leaves."""
FLAGS = cv2.CALIB_RECOMPUTE_EXTRINSIC | cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_SKEW
ENDED = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 30, 1e-6)


def fits_fisheye(
    boards: Sequence[Pixels], places: Sequence[Pixels], size_px: tuple[int, int], rms_px: float
) -> bool:
    """Whether a fisheye lens explains one eye's corners far better than to `rms_px`.

    `size_px` is the picture's width and height.
    """
    return any(
        found <= BETTER * rms_px
        for share in FOCAL_GUESSES
        if (found := _rms_px(boards, places, size_px, share * size_px[0])) is not None
    )


def _rms_px(
    boards: Sequence[Pixels], places: Sequence[Pixels], size_px: tuple[int, int], focal_px: float
) -> float | None:
    """Of the best fisheye lens from this start; None where the solver finds none."""
    points = [np.asarray(board, np.float64).reshape(1, -1, 3) for board in boards]
    pixels = [np.asarray(place, np.float64).reshape(1, -1, 2) for place in places]
    try:
        found, *_ = cv2.fisheye.calibrate(
            points, pixels, size_px, _start(size_px, focal_px), np.zeros((4, 1)),
            flags=FLAGS, criteria=ENDED,
        )  # fmt: skip
    except cv2.error:
        return None
    return float(found) if np.isfinite(found) else None


def _start(size_px: tuple[int, int], focal_px: float) -> Array:
    cx, cy = ((side - 1) / 2 for side in size_px)
    return np.array([(focal_px, 0, cx), (0, focal_px, cy), (0, 0, 1)])
