"""Which part of the pair to look at, from the tag."""

from __future__ import annotations

import math

from fieldcam.values import Calibration, Region, TagPose

REGION_MM = 180.0
"""Side of the square around the tag: its cluster hangs within 90 mm of it."""
MULTIPLE_PX = 32
MIN_SIDE_PX = 256


def around_tag(tag: TagPose, calibration: Calibration, width_px: int, height_px: int) -> Region:
    """A square of 180 mm at the tag's range around the tag, clipped to the image.

    Its sides are multiples of 32 px before clipping, as the networks like them.
    """
    range_mm = tag.range_mm
    if range_mm is None:
        return Region.whole(width_px, height_px)
    side = REGION_MM * calibration.px_per_mm(range_mm)
    half = max(math.ceil(side / MULTIPLE_PX) * MULTIPLE_PX, MIN_SIDE_PX) // 2
    x, y = round(tag.center_px[0]), round(tag.center_px[1])
    square = Region(x - half, y - half, x + half, y + half)
    return square.overlap(Region.whole(width_px, height_px))
