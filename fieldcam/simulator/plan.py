"""What grows in a simulated block: clusters, fruitlets, and their sizes by day.

Only numbers here, no geometry. Everything follows from the block's seed, so a
block can be planned again from the number that is stored with its captures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

EARLY_DAYS = 2.0
"""Growth rates are one broad hump before this day and split in two after it."""
FIRST_TAG_ID = 8


@dataclass(frozen=True, slots=True)
class FruitletPlan:
    """One fruitlet of a tagged cluster over the days of a season."""

    id: int
    first_diameter_mm: float
    """Equatorial diameter on day 0."""
    early_rate_mm_per_day: float
    late_rate_mm_per_day: float
    persists: bool
    falls_on_day: float
    """Infinite for a fruitlet that stays."""
    elongation: float
    """Length over equatorial diameter, at least 1."""

    def diameter_mm(self, day: float) -> float:
        """Equatorial diameter on a day, as if it still hung there."""
        early = min(day, EARLY_DAYS)
        late = max(day - EARLY_DAYS, 0.0)
        grown = early * self.early_rate_mm_per_day + late * self.late_rate_mm_per_day
        return self.first_diameter_mm + grown

    def hangs(self, day: float) -> bool:
        return day < self.falls_on_day


@dataclass(frozen=True, slots=True)
class ClusterPlan:
    """One tagged cluster: which fruitlets it has and the seed of its shape."""

    tag_id: int
    seed: int
    fruitlets: tuple[FruitletPlan, ...]


@dataclass(frozen=True, slots=True)
class BlockPlan:
    """The tagged clusters of one variety of one orchard in one season."""

    seed: int
    clusters: tuple[ClusterPlan, ...]

    @classmethod
    def plan(cls, seed: int, clusters: int, variety: Variety | None = None) -> BlockPlan:
        """Plan a block of a variety, else of a drawn one; equal arguments give equal blocks."""
        rng = np.random.default_rng([seed, 1])
        drawn = Variety.draw(rng)
        variety = variety or drawn
        seeds = rng.integers(1, 2**31, clusters)
        return cls(
            seed,
            tuple(
                ClusterPlan(FIRST_TAG_ID + i, int(s), _fruitlets(np.random.default_rng(s), variety))
                for i, s in enumerate(seeds)
            ),
        )


@dataclass(frozen=True, slots=True)
class Variety:
    """What the fruitlets of one block have in common in one season."""

    mean_diameter_mm: float
    persist_share: float
    elongation: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Variety:
        return cls(rng.uniform(6.5, 11.5), rng.uniform(0.28, 0.55), rng.uniform(1.03, 1.15))


def _fruitlets(rng: np.random.Generator, variety: Variety) -> tuple[FruitletPlan, ...]:
    count = int(rng.choice([3, 4, 5, 6, 7], p=[0.12, 0.22, 0.32, 0.22, 0.12]))
    mean_mm = variety.mean_diameter_mm * rng.lognormal(0.0, 0.12)
    return tuple(
        _fruitlet(rng, variety, i, mean_mm * (1.15 if i == 0 else 1.0)) for i in range(count)
    )


def _fruitlet(
    rng: np.random.Generator, variety: Variety, index: int, mean_mm: float
) -> FruitletPlan:
    """Draw one fruitlet; index 0 is the king, which is larger and stays more often."""
    persists = bool(rng.random() < variety.persist_share + (0.2 if index == 0 else -0.04))
    size_factor = rng.lognormal(0.04 if persists else -0.06, 0.13)
    early = rng.normal(0.68 if persists else 0.42, 0.2)
    late = rng.normal(0.8, 0.17) if persists else abs(rng.normal(0.08, 0.08))
    falls = np.inf if persists or rng.random() < 0.55 else rng.uniform(1.0, 8.0)
    return FruitletPlan(
        id=index,
        first_diameter_mm=float(np.clip(mean_mm * size_factor, 4.0, 17.0)),
        early_rate_mm_per_day=float(np.clip(early, 0.0, 1.2)),
        late_rate_mm_per_day=float(np.clip(late, 0.3 if persists else 0.0, 1.2)),
        persists=persists,
        falls_on_day=float(falls),
        elongation=float(max(1.0, rng.normal(variety.elongation, 0.025))),
    )
