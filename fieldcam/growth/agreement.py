"""How well two ways to measure agree (Bland and Altman 1986)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

ENOUGH = 20
"""Fruitlets measured both ways that allow a first honest statement."""
NORMAL95 = 1.96
"""Standard deviations on either side of the mean that hold 95 %."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Differences, camera less calipers."""

    n: int
    bias_mm: float
    """Their mean."""
    sd_mm: float | None
    """Their standard deviation (n - 1); None for a single one."""

    @property
    def limits_mm(self) -> tuple[float, float] | None:
        """Between these lie 95 % of the differences, as far as they are normal.

        None where fewer than ENOUGH were measured both ways.
        """
        if self.sd_mm is None or self.n < ENOUGH:
            return None
        return self.bias_mm - NORMAL95 * self.sd_mm, self.bias_mm + NORMAL95 * self.sd_mm


def agreement(camera_mm: Sequence[float], calipers_mm: Sequence[float]) -> Agreement | None:
    """Of fruit that were measured both ways, in the same order; None where there are none."""
    if not len(camera_mm):
        return None
    differences = np.subtract(camera_mm, calipers_mm)
    sd_mm = float(differences.std(ddof=1)) if len(differences) > 1 else None
    return Agreement(len(differences), float(differences.mean()), sd_mm)
