"""Fallen, or not seen? A fruitlet that is missing is looked for where it ought to hang.

Its place is predicted from its neighbours. Where the picture shows something nearer there,
the fruitlet may hang behind it; where one looks past the place at what lies behind, it would
have been found. What is left open is kept as a probability (Bayes' rule), and whoever is not
shown to have fallen counts as not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcam.growth.association.alignment import Whereabouts
from fieldcam.growth.association.points import F64, Points
from fieldcam.growth.places import View
from fieldcam.values import DisparityWindow, Floats

TRIED_PLACES = 64
SLACK_MM = 3.0
"""What lies this much before or behind a fruitlet's own surface may still be that surface."""
TOUCHING = 0.8
"""Middles of two fruitlets are never nearer than this share of the sum of their radii."""
FOUND = (0.995, 0.8)
"""Share of the hanging fruitlets that are found where the picture looks past all likely places,
and where something is seen at half of them or more: a place is known to a radius only, so that
even the second are many. Measured on blocks of their own (docs/growth.md)."""
COVERED_FROM = 0.5
NEAR_SD = 3.0
"""A newcomer within so many deviations of the place may be the fruitlet that is missed."""
FAINT_NEAR_SD = 2.0
"""The same for what only looks a little like a fruitlet, of which there is more."""
FALL_PER_VISIT = 0.1
"""Share of the hanging fruitlets that fall between two visits, before anything is known."""
FALLEN_FROM = 0.6
"""A fruitlet counts as fallen from this probability on; below it was not seen."""


@dataclass(frozen=True, slots=True, eq=False)
class LookedAt:
    """A picture in which a fruitlet is missing, and where it ought to be."""

    view: View
    points: Points
    place: Whereabouts
    diameter_mm: float
    newcomers_mm: F64
    """(M, 3) fruitlets of the picture that none of the earlier ones was matched with."""


def chance_found(looked: LookedAt) -> float:
    """How likely the picture would show the fruitlet if it hung there, 0 to 1."""
    if looked.view.reading.window is None:
        return 0.0
    covered = _covered_share(looked, looked.view.reading.window)
    past, before = FOUND
    return past + (before - past) * min(covered / COVERED_FROM, 1)


def may_be_there(looked: LookedAt) -> bool:
    """Whether something is there that may be the fruitlet: unmatched, without a depth, or faint."""
    reach_mm = NEAR_SD * looked.place.sd_mm
    gaps = np.linalg.norm(looked.newcomers_mm - looked.place.center_mm, axis=1)
    if (gaps < reach_mm).any():
        return True
    reading = looked.view.reading
    flat = [f.center_px for f in reading.fruitlets if f.range_mm is None]
    faint_reach_mm = FAINT_NEAR_SD * looked.place.sd_mm
    return _is_near(looked, flat, reach_mm) or _is_near(looked, reading.faint_px, faint_reach_mm)


def _is_near(looked: LookedAt, points_px: Sequence[tuple[float, float]], reach_mm: float) -> bool:
    """Whether one of some points stands in the picture near the place."""
    calibration, center_mm = looked.view.reading.calibration, looked.place.center_mm
    column, row = calibration.places_px(center_mm)
    gaps = (np.hypot(u - column, v - row) for u, v in points_px)
    reach_px = reach_mm * calibration.px_per_mm(float(center_mm[2]))
    return any(gap < reach_px for gap in gaps)


def _covered_share(looked: LookedAt, window: DisparityWindow) -> float:
    """Share of the front of a fruitlet, over the places where it may hang, that the picture
    does not look past: it hangs behind what is seen there, or is seen without being found.

    Where nothing was matched one looks into the distance.
    """
    calibration = looked.view.reading.calibration
    rng = np.random.default_rng(0)
    offsets = rng.normal(size=(TRIED_PLACES, 3)) * looked.place.sd_mm
    centers = looked.place.center_mm + offsets
    free = centers[_is_free(centers, looked)]
    free = free[free[:, 2] > looked.diameter_mm]
    if not len(free):
        return 1.0
    fronts = np.repeat(free[:, None], len(_DISK), axis=1)
    fronts[..., :2] += _DISK * looked.diameter_mm / 2
    seen = _sampled(window, calibration.places_px(fronts))
    return float(np.mean(seen > calibration.disparity_px(fronts[..., 2] + SLACK_MM)))


def chance_fallen(found_if_hanging: Sequence[float]) -> list[float]:
    """For each of the visits on end on which a fruitlet is missing: that it has fallen by then.

    `found_if_hanging` holds for each visit how likely it would have been found.
    """
    missed = 1 - np.asarray(found_if_hanging, np.float64)
    hanging = np.concatenate([[1.0], np.cumprod(missed * (1 - FALL_PER_VISIT))])
    falls = hanging[:-1] * FALL_PER_VISIT
    return [float(x) for x in np.cumsum(falls) / (falls.sum() + hanging[-1])]


def _is_free(centers_mm: F64, looked: LookedAt) -> F64:
    """Whether each place (K, 3) is not taken by a fruitlet that the picture shows."""
    points = looked.points
    if not points.seen:
        return np.ones(len(centers_mm), np.bool_)
    radii = np.nan_to_num(points.diameters_mm, nan=looked.diameter_mm) / 2
    gaps = np.linalg.norm(centers_mm[:, None] - points.centers_mm[None], axis=2)
    return np.asarray((gaps > TOUCHING * (radii + looked.diameter_mm / 2)).all(axis=1))


def _sampled(window: DisparityWindow, places_px: Floats) -> F64:
    """Disparity (...) at image places (..., 2); infinitely near outside of what was matched."""
    region = window.region
    column, row = np.moveaxis(np.rint(places_px).astype(int) - (region.x0, region.y0), -1, 0)
    inside = (column >= 0) & (column < region.width) & (row >= 0) & (row < region.height)
    found = window.disparity_px[row.clip(0, region.height - 1), column.clip(0, region.width - 1)]
    return np.where(inside, found, np.inf)


def disk_points(count: int) -> F64:
    """Points (count, 2) spread evenly over the unit disk."""
    k = np.arange(count)
    radius, angle = np.sqrt((k + 0.5) / count), k * np.pi * (3 - np.sqrt(5))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


_DISK = disk_points(32)
