"""What became of each fruitlet between two visits, before anything is forecast."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from fieldcam.growth.grown import Growth, ends_of, growth_of
from fieldcam.growth.noise import NOISE
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, SizeSource
from fieldcam.growth.visits import BlockVisit, visits_of
from fieldcam.growth.warnings.doubts import Doubt, growth_doubt, is_doubtful, may_be_reference

OUTLIER_Z = 3.0
"""Sizes this far from their visit's mean are left out (paper, "Fruitlet Sizing")."""
_HANGING = (Presence.SIZED, Presence.SEEN)
Key = tuple[int, str]
"""Tag and name of a fruitlet."""


@dataclass(frozen=True, slots=True)
class FollowedFruitlet:
    """One fruitlet between two visits."""

    fruitlet: FruitletRecord
    growth: Growth | None
    """Where both sizes are known, none is an outlier, and it is possible."""
    late: bool
    """It was not seen on the block's first visit."""
    new: bool
    """It is not among the initial ones: nothing says that it hung on the first visit, or its
    cluster was not tagged then."""
    ignored: bool
    """It has an outlier, or two sizes that no growth explains; by calipers, it has no size up
    to the first of the two visits."""
    fallen: bool
    """False where its cluster was missed: it leaves both counts with the others of it."""
    hangs: bool
    """It was seen on the second of the two visits."""
    sized_at_start: bool
    doubts: tuple[Doubt, ...] = ()
    """About the growth between its two sizes, be it counted or not."""


@dataclass(frozen=True, slots=True)
class _Interval:
    """Two visits of a block, and what holds for all its fruitlets between them."""

    block: BlockRecord
    first: BlockVisit
    """Of the block."""
    visits: tuple[BlockVisit, ...]
    """Those that give sizes, from the first of the two to the second."""
    outliers: Mapping[BlockVisit, frozenset[Key]]
    missed: frozenset[int]
    """Clusters."""

    @property
    def start(self) -> BlockVisit:
        return self.visits[0]

    @property
    def end(self) -> BlockVisit:
        return self.visits[-1]


def follow(block: BlockRecord, start: BlockVisit, end: BlockVisit) -> tuple[FollowedFruitlet, ...]:
    """Every fruitlet of which something is known up to `end`."""
    visits = visits_between(block, start, end)
    interval = _Interval(
        block,
        visits_of(block)[0],
        visits,
        {visit: _outliers(block, visit) for visit in visits},
        _missed(block, start) | _missed(block, end),
    )
    return tuple(
        _followed(fruitlet, interval)
        for fruitlet in block.fruitlets
        if any(day <= end.days[-1] for day in fruitlet.sightings)
    )


def visits_between(
    block: BlockRecord, start: BlockVisit, end: BlockVisit
) -> tuple[BlockVisit, ...]:
    """The visits whose sizes tell growth, the two among them.

    What a camera shows later was small or hidden before: it is judged by the widest interval
    that is known of it. An empty cell of a caliper table says nothing of the kind.
    """
    if block.source is SizeSource.CALIPERS:
        return start, end
    return tuple(v for v in visits_of(block) if start.first <= v.first <= end.first)


def _followed(fruitlet: FruitletRecord, interval: _Interval) -> FollowedFruitlet:
    by_camera = interval.block.source is SizeSource.CAMERA
    missed = fruitlet.tag_id in interval.missed
    fallen = not missed and _fell_by(fruitlet, interval.end.days[-1])
    growth = None if fallen or missed else growth_of(*ends_of(fruitlet, interval.visits))
    doubts = tuple(_doubts(fruitlet, growth, interval))
    wrong = Doubt.GROWTH in doubts or _is_outlier(fruitlet, interval)
    late = not _hung(fruitlet, interval.first)
    return FollowedFruitlet(
        fruitlet,
        growth=None if wrong else growth,
        late=late,
        new=late and not (by_camera and fruitlet.tag_id in interval.first.clusters),
        ignored=wrong or not (by_camera or _sized_by(fruitlet, interval.start.days[-1])),
        fallen=fallen,
        hangs=_hung(fruitlet, interval.end),
        sized_at_start=_size(fruitlet, interval.start) is not None,
        doubts=doubts,
    )


def _doubts(
    fruitlet: FruitletRecord, growth: Growth | None, interval: _Interval
) -> Iterator[Doubt]:
    ended = interval.end.sighting(fruitlet)
    if growth is None or ended is None:
        return
    if is_doubtful(ended[1]):
        yield Doubt.MATCH
    if doubt := growth_doubt(growth, NOISE[interval.block.source]):
        yield doubt


def _is_outlier(fruitlet: FruitletRecord, interval: _Interval) -> bool:
    """Whether the size that it starts from is one, or that on the second of the two visits."""
    sized = [visit for visit in interval.visits if _size(fruitlet, visit) is not None]
    key = fruitlet.tag_id, fruitlet.fruitlet
    return any(key in interval.outliers[visit] for visit in {*sized[:1], interval.end})


def growth_of_sure(followed: Sequence[FollowedFruitlet]) -> list[Growth]:
    """Of whom the reference is made: no doubtful match is among them, but where all are."""
    known = [(each.growth, each.doubts) for each in followed if each.growth is not None]
    sure = [growth for growth, doubts in known if may_be_reference(doubts)]
    return sure or [growth for growth, _ in known]


def _size(fruitlet: FruitletRecord, visit: BlockVisit) -> float | None:
    found = visit.sighting(fruitlet)
    return None if found is None else found[1].diameter_mm


def _hung(fruitlet: FruitletRecord, visit: BlockVisit) -> bool:
    found = visit.sighting(fruitlet)
    return found is not None and found[1].presence in _HANGING


def _sized_by(fruitlet: FruitletRecord, day: date) -> bool:
    return any(
        seen.presence is Presence.SIZED for on, seen in fruitlet.sightings.items() if on <= day
    )


def _missed(block: BlockRecord, visit: BlockVisit) -> frozenset[int]:
    """Clusters that were not visited though something may have hung on them.

    Of those, only what fell before would be known, which is no sample of the cluster.
    """
    return frozenset(
        each.tag_id
        for each in block.fruitlets
        if each.tag_id not in visit.clusters and not _fell_by(each, visit.days[-1])
    )


def _fell_by(fruitlet: FruitletRecord, day: date) -> bool:
    return _last_certain(fruitlet, day) is Presence.FALLEN


def _last_certain(fruitlet: FruitletRecord, day: date) -> Presence | None:
    """The last that is known up to a day; that a place was hidden says nothing."""
    certain = [
        (on, seen.presence)
        for on, seen in fruitlet.sightings.items()
        if on <= day and seen.presence is not Presence.NOT_SEEN
    ]
    return max(certain)[1] if certain else None


def _outliers(block: BlockRecord, visit: BlockVisit) -> frozenset[Key]:
    """Fruitlets whose size the camera got wrong; calipers are taken as read."""
    if block.source is not SizeSource.CAMERA:
        return frozenset()
    sizes = {
        (each.tag_id, each.fruitlet): size
        for each in block.fruitlets
        if (size := _size(each, visit)) is not None
    }
    values = np.array(list(sizes.values()))
    far = OUTLIER_Z * values.std() if sizes else 0.0
    middle = values.mean() if sizes else 0.0
    return frozenset(key for key, mm in sizes.items() if far > 0.0 and abs(mm - middle) >= far)
