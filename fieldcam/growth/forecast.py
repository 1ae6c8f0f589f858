"""The fruitlet growth model: which fruitlets of a block will stay on the tree.

After Greene et al. 2013 as in the paper, "Growth Rate Tracking": a fruitlet persists
when it grows faster than half the mean of the 20 fastest of the block.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from enum import StrEnum
from statistics import median

import numpy as np

from fieldcam.errors import BadInput
from fieldcam.growth.following import FollowedFruitlet, follow, growth_of_sure
from fieldcam.growth.grown import Growth
from fieldcam.growth.noise import NOISE
from fieldcam.growth.records import BlockRecord, FruitletRecord, SizeSource
from fieldcam.growth.reference import FASTEST, Reference, mean_of_fastest
from fieldcam.growth.resampling import Interval, Resampled, interval90, resample
from fieldcam.growth.visits import BlockVisit, intervals, visit_on, visits_of
from fieldcam.growth.warnings.doubts import MAX_MM_PER_DAY, Doubt


class FruitletState(StrEnum):
    """What the model says of a fruitlet."""

    PERSIST = "persist"
    ABSCISE = "abscise"
    """It hangs there, and will fall."""
    FALLEN = "fallen"
    NOT_SEEN = "not_seen"
    """It has no growth rate, and is not known to have fallen."""
    NEW = "new"
    """By calipers, it has no size on the block's first visit; by camera, its cluster was tagged
    later. It is not among the initial ones."""
    IGNORED = "ignored"
    """It has an outlier or impossible growth; by calipers, no size up to the first of the two
    visits. It is not among the initial ones."""


_JUDGED = (FruitletState.PERSIST, FruitletState.ABSCISE, FruitletState.FALLEN)


@dataclass(frozen=True, slots=True)
class FruitletForecast:
    """One fruitlet."""

    fruitlet: FruitletRecord
    growth: Growth | None
    """None without two sizes that count."""
    state: FruitletState
    doubts: tuple[Doubt, ...] = ()

    @property
    def rate_mm_per_day(self) -> float | None:
        return None if self.growth is None else self.growth.rate_mm_per_day

    @property
    def sizes_mm(self) -> Mapping[date, float]:
        """All its sizes by day."""
        seen_on = self.fruitlet.seen_on
        return {day: seen.diameter_mm for day, seen in seen_on if seen.diameter_mm is not None}

    @property
    def sds_mm(self) -> Mapping[date, float]:
        """Standard deviations of its sizes by day, as far as they are known."""
        return {day: seen.sd_mm for day, seen in self.fruitlet.seen_on if seen.sd_mm is not None}


@dataclass(frozen=True, slots=True)
class Counts:
    """How many of a block's, or a cluster's, first fruitlets became what."""

    initial: int
    persist: int
    abscise: int
    """Those that have fallen among them."""
    fallen: int
    not_seen: int

    @property
    def judged(self) -> int:
        """The initial ones of which the model can say something."""
        return self.initial - self.not_seen

    @property
    def set_pct(self) -> float | None:
        """Persisting ones in percent of those judged; None when there are none."""
        return 100.0 * self.persist / self.judged if self.judged else None


@dataclass(frozen=True, slots=True)
class Forecast:
    """What growth between two visits says about a block."""

    block: BlockRecord
    start: BlockVisit
    end: BlockVisit
    days: float
    """Median of the fruitlets' own days between their two sizes."""
    reference: Reference
    counts: Counts
    fruitlets: tuple[FruitletForecast, ...]
    resampled: Resampled

    @property
    def set_pct(self) -> float:
        """Of the initial fruitlets; those not seen leave both counts."""
        share = self.counts.set_pct
        return 0.0 if share is None else share

    @property
    def ignored(self) -> int:
        """Fruitlets that would be among the initial ones, if they could be judged."""
        return sum(each.state is FruitletState.IGNORED for each in self.fruitlets)

    @property
    def interval90_pct(self) -> Interval:
        """Of the set of the tagged clusters: what measuring errors leave open."""
        return interval90(self.resampled.set_of_tagged_pct, self.set_pct)

    @property
    def interval90_trees_pct(self) -> Interval | None:
        """Of the set on all trees: the sampling of clusters added.

        None where one cluster is all that is known: nothing says how others differ.
        """
        if self.judged_clusters < 2:
            return None
        low, high = interval90(self.resampled.set_of_trees_pct, self.set_pct)
        of_tagged = self.interval90_pct
        return min(low, of_tagged[0]), max(high, of_tagged[1])

    @property
    def judged_clusters(self) -> int:
        """Clusters of whose initial fruitlets the model can say something."""
        return len({each.fruitlet.tag_id for each in self.fruitlets if each.state in _JUDGED})


def forecast(block: BlockRecord, start: date, end: date) -> Forecast:
    """The forecast from two visits, each named by one of its days.

    Raises BadInput when there were no such visits, or no fruitlet grew between them.
    """
    before, after = visit_on(block, start), visit_on(block, end)
    if before.first >= after.first:
        raise BadInput(f"The visit of {after.first} is not after that of {before.first}.")
    followed = follow(block, before, after)
    if not _any_grew(followed):
        raise BadInput(_why_none(block, followed, before, after))
    return _forecast(block, before, after, followed)


def trend(block: BlockRecord) -> tuple[Forecast, ...]:
    """A forecast at each visit that has one, from it and the best visit to compare it with."""
    found = []
    for start, end in intervals(visits_of(block)):
        followed = follow(block, start, end)
        if _any_grew(followed):
            found.append(_forecast(block, start, end, followed))
    return tuple(found)


def _any_grew(followed: Sequence[FollowedFruitlet]) -> bool:
    return any(each.growth is not None for each in followed)


def _forecast(
    block: BlockRecord, before: BlockVisit, after: BlockVisit, followed: Sequence[FollowedFruitlet]
) -> Forecast:
    growth = [each.growth for each in followed if each.growth is not None]
    resampled = resample(followed, NOISE[block.source])
    rates = np.array([each.rate_mm_per_day for each in growth_of_sure(followed)])
    reference = _reference(block.source, rates, resampled)
    fruitlets = tuple(_judged(each, reference.cutoff_mm_per_day) for each in followed)
    return Forecast(
        block,
        before,
        after,
        days=median(each.days for each in growth),
        reference=reference,
        counts=counts_of(fruitlets),
        fruitlets=fruitlets,
        resampled=resampled,
    )


def counts_of(fruitlets: Sequence[FruitletForecast]) -> Counts:
    """New and ignored fruitlets are not counted."""
    states = Counter(each.state for each in fruitlets)
    fallen, not_seen = states[FruitletState.FALLEN], states[FruitletState.NOT_SEEN]
    abscise = states[FruitletState.ABSCISE] + fallen
    initial = states[FruitletState.PERSIST] + abscise + not_seen
    return Counts(initial, states[FruitletState.PERSIST], abscise, fallen, not_seen)


def _reference(source: SizeSource, rates: np.ndarray, resampled: Resampled) -> Reference:
    """Growers' spreadsheets, and the trials behind the 50 %, take calipers as they read.

    The mean of all, where they are so few, is not pushed up by choosing the fastest.
    """
    measured, corrected = mean_of_fastest(rates), resampled.reference_mm_per_day
    chosen = source is SizeSource.CAMERA and len(rates) >= FASTEST
    used = corrected if chosen else measured
    return Reference(min(FASTEST, len(rates)), used, measured, corrected)


def _judged(followed: FollowedFruitlet, cutoff_mm_per_day: float) -> FruitletForecast:
    state = _state(followed, cutoff_mm_per_day)
    return FruitletForecast(followed.fruitlet, followed.growth, state, followed.doubts)


def _state(followed: FollowedFruitlet, cutoff_mm_per_day: float) -> FruitletState:
    if followed.new:
        return FruitletState.NEW
    if followed.ignored:
        return FruitletState.IGNORED
    if followed.fallen:
        return FruitletState.FALLEN
    if followed.growth is None:
        return FruitletState.NOT_SEEN
    persists = followed.growth.rate_mm_per_day > cutoff_mm_per_day
    return FruitletState.PERSIST if persists else FruitletState.ABSCISE


def _why_none(
    block: BlockRecord, followed: Sequence[FollowedFruitlet], start: BlockVisit, end: BlockVisit
) -> str:
    if any(Doubt.GROWTH in each.doubts for each in followed):
        return (
            f"All fruitlets of block {block.name} that have a size both on {start} and on {end}"
            f" grew more than {MAX_MM_PER_DAY} mm/day. Are the sizes in mm, and the dates right?"
        )
    fallen = sum(each.fallen for each in followed)
    all_fell = f"all {fallen} have fallen"
    some = f"{fallen} of {len(followed)} have fallen, the others were not seen or not sized"
    return (
        f"No fruitlet of block {block.name} has a size both on {start} and on {end}:"
        f" {all_fell if followed and fallen == len(followed) else some}."
    )
