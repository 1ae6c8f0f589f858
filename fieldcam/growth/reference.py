"""The fastest fruitlets of a block, against which all others are judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcam.values import Floats

FASTEST = 20
"""Of the whole block (Greene et al. 2013)."""
PERSISTS_ABOVE = 0.5
"""Share of the reference."""


@dataclass(frozen=True, slots=True)
class Reference:
    """Mean rate of the fastest fruitlets."""

    n: int
    """FASTEST, or all where fewer have a rate."""
    rate_mm_per_day: float
    """The one that counts: corrected where a camera measured FASTEST or more, else measured."""
    measured_mm_per_day: float
    """Straight from the sizes; their errors push it up."""
    corrected_mm_per_day: float
    """What the true rates most likely gave, those of fruitlets not seen among them."""

    @property
    def cutoff_mm_per_day(self) -> float:
        """A fruitlet persists when it grows faster, strictly; none does that shrinks."""
        return PERSISTS_ABOVE * max(self.rate_mm_per_day, 0.0)


def mean_of_fastest(rates: Floats) -> float:
    """Mean of the FASTEST largest of (N,) rates, or of all where they are fewer."""
    return float(round(np.sort(rates)[-FASTEST:].mean(), 9))


def weighted_means_of_fastest(rates: Floats, weights: Floats) -> Floats:
    """(R,) the same for R sets of rates (R, N), where a fruitlet may count more or less often.

    Those of weight 0 take no part.
    """
    order = np.argsort(-rates, axis=1)
    counted = np.minimum(np.cumsum(np.take_along_axis(weights, order, axis=1), axis=1), FASTEST)
    used = np.diff(counted, axis=1, prepend=0.0)
    fastest = np.take_along_axis(rates, order, axis=1)
    return np.asarray((used * fastest).sum(axis=1) / used.sum(axis=1))
