"""Which clusters a forecast hangs on: the same forecast without each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcam.growth.forecast import Counts, Forecast, FruitletForecast, State, counts_of
from fieldcam.growth.reference import PERSISTS_ABOVE, mean_of_fastest


@dataclass(frozen=True, slots=True)
class ClusterInfluence:
    """One tagged cluster in a forecast."""

    tag_id: int
    tree: str | None
    counts: Counts
    influence_points: float
    """By how much the set of the block is higher with this cluster than without it."""


def influences(found: Forecast) -> tuple[ClusterInfluence, ...]:
    """Every cluster, the most influential first."""
    by_tag: dict[int, list[FruitletForecast]] = {}
    for each in found.fruitlets:
        by_tag.setdefault(each.fruitlet.tag_id, []).append(each)
    clusters = [
        ClusterInfluence(
            tag,
            found.block.tree_of.get(tag),
            counts_of(fruitlets),
            found.set_pct - _set_without(found, tag),
        )
        for tag, fruitlets in by_tag.items()
    ]
    return tuple(sorted(clusters, key=lambda each: (-abs(each.influence_points), each.tag_id)))


def _set_without(found: Forecast, tag_id: int) -> float:
    """Set in percent with the same correction of the reference; unchanged where none is left."""
    others = [each for each in found.fruitlets if each.fruitlet.tag_id != tag_id]
    rates = np.array([e.rate_mm_per_day for e in others if e.rate_mm_per_day is not None])
    judged = sum(e.state in (State.PERSIST, State.ABSCISE, State.FALLEN) for e in others)
    if not judged or not rates.size:
        return found.set_pct
    correction = found.reference.rate_mm_per_day - found.reference.measured_mm_per_day
    cutoff = PERSISTS_ABOVE * max(mean_of_fastest(rates) + correction, 0.0)
    return 100.0 * _persisting(others, cutoff) / judged


def _persisting(fruitlets: Sequence[FruitletForecast], cutoff_mm_per_day: float) -> int:
    return sum(
        each.state in (State.PERSIST, State.ABSCISE)
        and each.rate_mm_per_day is not None
        and each.rate_mm_per_day > cutoff_mm_per_day
        for each in fruitlets
    )
