"""Names the family of a tag that is no tag36h11, for a picture in which none was read."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from fieldcam.calibration.aruco_families import marker_counts
from fieldcam.images.grey import as_grey
from fieldcam.values import ImageU8
from fieldcam.vision.tags.detection import (
    LOWEST_DECISION_MARGIN,
    SMALLEST_SIDE_PX,
    SharedDetector,
)

APRILTAGS = ("tag25h9", "tagStandard41h12", "tagCircle21h7")
"""On 50 photographs of apples none was seen; tag16h5 is left out, since leaves make it."""
NOT_ASKED = ("tag36h11", "tag16h5", "ArUco 4x4")
"""Ours, and those of so few cells that leaves make them."""
SHRUNK = 0.5
"""For ArUco: a card of the working range has 40 px then, which is plenty, in a quarter of the
time."""
MIN_SIDE_PX = 25
"""Of the shrunk picture; smaller ones are mostly none."""


def other_family(image: ImageU8) -> str:
    """Such as `tag25h9` or `ArUco 6x6`; empty where no tag of these is seen.

    `image` is (H, W, 3) or (H, W).
    """
    if min(image.shape[:2]) < SMALLEST_SIDE_PX:
        return ""
    whole = np.ascontiguousarray(as_grey(image))
    clear = [
        detection.tag_family.decode()
        for detection in _apriltags().detect(whole)
        if detection.decision_margin >= LOWEST_DECISION_MARGIN
    ]
    return clear[0] if clear else _aruco_family(whole)


def _aruco_family(grey: ImageU8) -> str:
    small = cv2.resize(grey, None, fx=SHRUNK, fy=SHRUNK, interpolation=cv2.INTER_AREA)
    counts = marker_counts(np.asarray(small, np.uint8), MIN_SIDE_PX)
    seen = {name: count for name, count in counts.items() if count and name not in NOT_ASKED}
    return max(seen, key=lambda name: seen[name], default="")


@lru_cache(maxsize=1)
def _apriltags() -> SharedDetector:
    return SharedDetector(" ".join(APRILTAGS))
