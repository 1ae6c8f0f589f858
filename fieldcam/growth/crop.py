"""From the set of fruitlets to fruit on a tree, and whether that is what was wanted."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from fieldcam.growth.forecast import Forecast
from fieldcam.growth.resampling import Interval, interval90

FRUITLETS_PER_BLOOM_CLUSTER = 5
"""What growers reckon with when they speak of a tree's potential (Malusim, Cornell)."""


class CropVerdict(StrEnum):
    """The forecast against the target."""

    TOO_MANY = "too_many"
    """The whole interval lies above the target: thin again."""
    ON_TARGET = "on_target"
    """The interval holds the target."""
    TOO_FEW = "too_few"
    """The whole interval lies below the target: stop thinning."""


_AGAINST_TARGET = {
    CropVerdict.TOO_MANY: "more than the target of {:g}: thin again",
    CropVerdict.ON_TARGET: "the target of {:g} is within reach",
    CropVerdict.TOO_FEW: "fewer than the target of {:g}: do not thin any more",
}


@dataclass(frozen=True, slots=True)
class CropPlan:
    """What the grower counted and wants, per tree."""

    bloom_clusters: float
    """Mean flower clusters of a tree, all of them, not only the tagged."""
    target_fruit: float | None = None


@dataclass(frozen=True, slots=True)
class CropForecast:
    """Fruit per tree."""

    plan: CropPlan
    fruit: float
    interval90_fruit: Interval | None
    """None where one cluster is all that is known: it says nothing of the other ones."""
    fruit_by_potential: float
    """The set times FRUITLETS_PER_BLOOM_CLUSTER for each bloom cluster, as Malusim shows it;
    too high where clusters carry fewer."""

    @property
    def verdict(self) -> CropVerdict | None:
        """None without a target, or without an interval."""
        target, interval = self.plan.target_fruit, self.interval90_fruit
        if target is None or interval is None:
            return None
        low, high = interval
        if low > target:
            return CropVerdict.TOO_MANY
        return CropVerdict.TOO_FEW if high < target else CropVerdict.ON_TARGET

    @property
    def against_target(self) -> str:
        """The verdict for the end of a sentence; empty without one."""
        if self.verdict is None:
            return ""
        return _AGAINST_TARGET[self.verdict].format(self.plan.target_fruit)


def crop_forecast(found: Forecast, plan: CropPlan) -> CropForecast:
    """Bloom clusters of a tree times persisting fruitlets of a tagged cluster.

    That needs no guess how many fruitlets a cluster carries; clusters that lost all of
    theirs count. Fruitlets not seen, new or ignored persist as often as the others.
    """
    clusters = len({each.fruitlet.tag_id for each in found.fruitlets})
    share = found.set_pct / 100.0
    fruit = plan.bloom_clusters * share * len(found.fruitlets) / clusters
    resampled = plan.bloom_clusters * found.resampled.persist_per_cluster
    return CropForecast(
        plan,
        fruit=fruit,
        interval90_fruit=interval90(resampled, fruit) if found.judged_clusters > 1 else None,
        fruit_by_potential=plan.bloom_clusters * FRUITLETS_PER_BLOOM_CLUSTER * share,
    )
