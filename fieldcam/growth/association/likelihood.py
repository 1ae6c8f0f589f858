"""How likely two sightings are one fruitlet, against being two different ones.

A log odds: its places differ by what stems, growth and measuring allow, and its sizes by
what a fruitlet grows, which never shrinks; two different ones lie anywhere in a cluster and
have any size.
The values were measured on rendered blocks kept for choosing (`export.study_captures`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from fieldcam.growth.association.points import F64, Points


@dataclass(frozen=True, slots=True)
class Plausibility:
    """What moves and grows between two pictures of a cluster; `_sd` are standard deviations."""

    still_sd_mm: float = 2.0
    """Of a fruitlet's place in its cluster along each axis, same day: mostly depth."""
    bent_sd_mm: float = 3.8
    """The same on different days: stems bend, fruitlets push each other aside."""
    turn_sd_rad: float = 0.35
    """Of the cluster in the picture, about each axis: camera and spur together."""
    swing_sd_mm: float = 15.0
    """Of the cluster's middle against its tag, along each axis."""
    spread_per_day: float = 0.045
    """Stems and fruitlets grow, so that a cluster's middles move apart by this share."""
    spread_sd_per_day: float = 0.03
    rate_mm_per_day: float = 0.45
    rate_sd_mm_per_day: float = 0.35
    size_sd_mm: float = 0.3
    """Of one measured size, whatever less it says of itself: the worst errors go unnoticed."""
    reach_mm: float = 60.0
    """Side of the box that a cluster's fruitlets lie in."""
    size_range_mm: float = 8.0
    seen_share: float = 0.85
    """Of the fruitlets in one picture that the other shows too."""

    def place_sd_mm(self, days: float) -> float:
        """Of a fruitlet's place along each axis."""
        return self.still_sd_mm if days == 0 else self.bent_sd_mm

    def spread_sd(self, days: float) -> float:
        """Of the logarithm of how far the cluster's middles moved apart."""
        return 0.01 + self.spread_sd_per_day * abs(days)

    def place_log_odds(self, gaps_mm: F64, days: float) -> F64:
        """(..., N, M) from gaps (..., N, M, 3) between places."""
        sd = self.place_sd_mm(days)
        place = -((gaps_mm**2).sum(axis=-1)) / (2 * sd**2)
        place += 3 * np.log(self.reach_mm / (sd * np.sqrt(2 * np.pi)))
        share = self.seen_share
        place += np.log(share / (1 - share) ** 2) / 2
        return np.asarray(place)

    def size_log_odds(self, first: Points, second: Points, days: float) -> F64:
        """(N, M); nothing is known where either size is missing."""
        grown_mm = second.diameters_mm[None, :] - first.diameters_mm[:, None]
        error_mm = np.hypot.outer(*(np.fmax(p.sds_mm, self.size_sd_mm) for p in (first, second)))
        odds = self._growth_log_density(grown_mm, error_mm, days) + np.log(self.size_range_mm)
        return np.asarray(np.where(np.isfinite(odds), odds, 0.0))

    def _growth_log_density(self, grown_mm: F64, error_mm: F64, days: float) -> F64:
        """Of a normal growth cut off at zero, plus a normal error."""
        mean_mm, sd_mm = self.rate_mm_per_day * days, self.rate_sd_mm_per_day * days
        total_mm = np.hypot(sd_mm, error_mm)
        density = -(((grown_mm - mean_mm) / total_mm) ** 2) / 2
        density -= np.log(total_mm * np.sqrt(2 * np.pi))
        if days == 0:
            return np.asarray(density)
        likely = (grown_mm * sd_mm**2 + mean_mm * error_mm**2) / (sd_mm * error_mm * total_mm)
        return np.asarray(density + log_ndtr(likely) - log_ndtr(mean_mm / sd_mm))
