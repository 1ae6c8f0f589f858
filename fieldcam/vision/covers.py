"""What lies in front of each fruitlet: nearer fruitlets, and nearer surfaces of any kind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from fieldcam.vision.sizing.outline import Cover, window_around

from fieldcam.values import BoolMask, Calibration, DisparityWindow, FloatMap, Instance, Mask, Region
from fieldcam.vision.clouds import FruitletCloud, cut

TIE_PX = 0.5
"""A neighbour this much nearer (disparity) is in front of a fruitlet."""
FRONT_MARGIN_PX = 1.0
"""How far in front of the fruitlet's nearest point a surface must lie to count."""


def covers(
    instances: Sequence[Instance],
    clouds: Sequence[FruitletCloud],
    window: DisparityWindow,
    calibration: Calibration,
) -> list[Cover]:
    """For each instance, the pixels around it that belong to something nearer."""
    nearness = [median_disparity(i, c, window) for i, c in zip(instances, clouds, strict=True)]
    return [_cover(k, instances, nearness, window, calibration) for k in range(len(instances))]


def median_disparity(
    instance: Instance, cloud: FruitletCloud, window: DisparityWindow
) -> float | None:
    """Median raw disparity over the trusted pixels of an instance."""
    values: FloatMap = cut(window, instance.visible.region)[cloud.known]
    values = values[np.isfinite(values)]
    return float(np.median(values)) if values.size else None


def _cover(
    index: int,
    instances: Sequence[Instance],
    nearness: Sequence[float | None],
    window: DisparityWindow,
    calibration: Calibration,
) -> Cover:
    own, own_disparity = instances[index], nearness[index]
    region = window_around(own)
    blocked = np.zeros((region.height, region.width), dtype=np.bool_)
    if own_disparity is not None:
        front = _front_disparity(own.visible.area_px, own_disparity, calibration)
        blocked = cut(window, region) > front + FRONT_MARGIN_PX
    for other, disparity in zip(instances, nearness, strict=True):
        # Where either depth is unknown, the edge between the two is nobody's.
        behind = (
            own_disparity is not None
            and disparity is not None
            and disparity <= own_disparity + TIE_PX
        )
        if other is not own and not behind:
            _paint(blocked, region, other.visible)
    return Cover(region, blocked)


def _front_disparity(area_px: int, disparity_px: float, calibration: Calibration) -> float:
    """Disparity of the nearest point of a sphere that shows this area.

    Half of its visible surface lies more than 0.7 radii in front of its centre.
    """
    range_mm = calibration.range_mm(disparity_px)
    radius_mm = float(np.sqrt(area_px / np.pi)) * range_mm / calibration.focal_px
    return calibration.disparity_px(range_mm - (1 - np.sqrt(0.5)) * radius_mm)


def _paint(blocked: BoolMask, region: Region, mask: Mask) -> None:
    """Mark another mask's pixels where it overlaps a region, in place."""
    other = mask.region
    x0, x1 = max(region.x0, other.x0), min(region.x1, other.x1)
    y0, y1 = max(region.y0, other.y0), min(region.y1, other.y1)
    if x0 < x1 and y0 < y1:
        part = mask.window[y0 - other.y0 : y1 - other.y0, x0 - other.x0 : x1 - other.x0]
        blocked[y0 - region.y0 : y1 - region.y0, x0 - region.x0 : x1 - region.x0] |= part
