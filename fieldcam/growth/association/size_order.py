"""Association by size alone, as growers do who do not number their fruitlets."""

from __future__ import annotations

import numpy as np

from fieldcam.growth.association.points import F64, Points


def match_by_size_order(first: Points, second: Points) -> F64:
    """Certainty (N, M): the largest with the largest and so on; who has no size has no match."""
    certainty = np.zeros((len(first.seen), len(second.seen)))
    one, other = _largest_first(first), _largest_first(second)
    for i, j in zip(one, other, strict=False):
        certainty[i, j] = 1.0
    return certainty


def _largest_first(points: Points) -> list[int]:
    sizes = points.diameters_mm
    known = np.flatnonzero(np.isfinite(sizes))
    return [int(i) for i in known[np.argsort(-sizes[known], kind="stable")]]
