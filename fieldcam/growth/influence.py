"""Which clusters a forecast hangs on: the same forecast without each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from fieldcam.growth.forecast import Counts, Forecast, FruitletForecast, FruitletState, counts_of
from fieldcam.growth.reference import FASTEST, PERSISTS_ABOVE, mean_of_fastest
from fieldcam.growth.warnings.doubts import may_be_reference
from fieldcam.values import Floats


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
    rates = _Rates.of(found)
    clusters = [
        ClusterInfluence(
            tag,
            found.block.tree_of.get(tag),
            counts_of(fruitlets),
            found.set_pct - _set_without(found, rates, tag, fruitlets),
        )
        for tag, fruitlets in by_tag.items()
    ]
    return tuple(sorted(clusters, key=lambda each: (-abs(each.influence_points), each.tag_id)))


@dataclass(frozen=True, slots=True, eq=False)
class _Rates:
    """The block's rates in order, so that leaving a cluster out looks at few of them."""

    fastest_first: Sequence[tuple[float, int]]
    """With their tags; those of new fruitlets are among them, doubtful ones are not."""
    judged: Floats
    """(N,) rising, of those that the model judges."""

    @classmethod
    def of(cls, found: Forecast) -> _Rates:
        known = [
            (each.rate_mm_per_day, each.fruitlet.tag_id, each.doubts)
            for each in found.fruitlets
            if each.rate_mm_per_day is not None
        ]
        sure = [(rate, tag) for rate, tag, doubts in known if may_be_reference(doubts)]
        judged = np.sort(np.array(_judged_rates(found.fruitlets), np.float64))
        fastest = sure or [(rate, tag) for rate, tag, _ in known]
        return cls(sorted(fastest, reverse=True), judged)

    def fastest_without(self, tag_id: int) -> Floats:
        """Rates (N,) of the FASTEST of all other clusters, or as many as there are."""
        others = (rate for rate, tag in self.fastest_first if tag != tag_id)
        return np.array(list(islice(others, FASTEST)))

    def above(self, cutoff_mm_per_day: float) -> int:
        """How many are judged to persist at such a cutoff."""
        return len(self.judged) - int(np.searchsorted(self.judged, cutoff_mm_per_day, "right"))


def _set_without(
    found: Forecast, rates: _Rates, tag_id: int, own: Sequence[FruitletForecast]
) -> float:
    """Set in percent with the same correction of the reference; unchanged where none is left."""
    fastest = rates.fastest_without(tag_id)
    judged = found.counts.judged - counts_of(own).judged
    if not judged or not fastest.size:
        return found.set_pct
    correction = found.reference.rate_mm_per_day - found.reference.measured_mm_per_day
    cutoff = PERSISTS_ABOVE * max(mean_of_fastest(fastest) + correction, 0.0)
    own_above = sum(rate > cutoff for rate in _judged_rates(own))
    return 100.0 * (rates.above(cutoff) - own_above) / judged


def _judged_rates(fruitlets: Sequence[FruitletForecast]) -> list[float]:
    return [
        each.rate_mm_per_day
        for each in fruitlets
        if each.state in (FruitletState.PERSIST, FruitletState.ABSCISE)
        and each.rate_mm_per_day is not None
    ]
