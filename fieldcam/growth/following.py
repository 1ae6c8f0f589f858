"""What became of each fruitlet between two visits, before anything is forecast."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from fieldcam.growth.doubts import MOST_MM_PER_DAY, Doubt, is_doubtful
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Source
from fieldcam.growth.visits import BlockVisit, visits_of

OUTLIER_Z = 3.0
"""Sizes this far from their visit's mean are left out (paper, "Fruitlet Sizing")."""
_HANGING = (Presence.SIZED, Presence.SEEN)
_RATE_DIGITS = 9


@dataclass(frozen=True, slots=True)
class Growth:
    """A fruitlet's two sizes, each with the fruitlet's own day."""

    start_mm: float
    end_mm: float
    days: int

    @property
    def rate_mm_per_day(self) -> float:
        """Rounded where binary fractions end, so that a tie of written sizes is a tie."""
        return round((self.end_mm - self.start_mm) / self.days, _RATE_DIGITS)

    @property
    def impossible(self) -> bool:
        """Shrinking never is: what the tree gives up shrinks, and calipers slip."""
        return self.rate_mm_per_day > MOST_MM_PER_DAY


@dataclass(frozen=True, slots=True)
class Followed:
    """One fruitlet between two visits."""

    fruitlet: FruitletRecord
    growth: Growth | None
    """Where both sizes are known, none is an outlier, and it is possible."""
    new: bool
    """It was not there on the block's first visit."""
    ignored: bool
    """It has no size up to the first of the two visits, one that is an outlier, or two that
    no growth explains."""
    fallen: bool
    """False where its cluster was missed: it leaves both counts with the others of it."""
    hangs: bool
    """It was seen on the second of the two visits."""
    sized_at_start: bool
    doubts: tuple[Doubt, ...] = ()
    """About the growth between its two sizes, be it counted or not."""


def follow(block: BlockRecord, start: BlockVisit, end: BlockVisit) -> tuple[Followed, ...]:
    """Every fruitlet of which something is known up to `end`."""
    first = visits_of(block)[0]
    outliers = _outliers(block, start) | _outliers(block, end)
    missed = _missed(block, start) | _missed(block, end)
    return tuple(
        _followed(
            fruitlet,
            first,
            start,
            end,
            outlier=(fruitlet.tag_id, fruitlet.fruitlet) in outliers,
            missed=fruitlet.tag_id in missed,
        )
        for fruitlet in block.fruitlets
        if any(day <= end.days[-1] for day in fruitlet.sightings)
    )


def _followed(
    fruitlet: FruitletRecord,
    first: BlockVisit,
    start: BlockVisit,
    end: BlockVisit,
    outlier: bool,
    missed: bool,
) -> Followed:
    fallen = not missed and _fell_by(fruitlet, end.days[-1])
    growth = None if fallen else growth_between(fruitlet, start, end)
    wrong = outlier or (growth is not None and growth.impossible)
    began = first.sighting(fruitlet)
    ended = end.sighting(fruitlet)
    return Followed(
        fruitlet,
        growth=None if wrong else growth,
        new=began is None or began[1].presence not in _HANGING,
        ignored=wrong or not _sized_by(fruitlet, start.days[-1]),
        fallen=fallen,
        hangs=ended is not None and ended[1].presence in _HANGING,
        sized_at_start=_size(fruitlet, start) is not None,
        doubts=tuple(_doubts(fruitlet, start, end)),
    )


def _doubts(fruitlet: FruitletRecord, start: BlockVisit, end: BlockVisit) -> Iterator[Doubt]:
    growth, ended = growth_between(fruitlet, start, end), end.sighting(fruitlet)
    if growth is not None and ended is not None and is_doubtful(ended[1]):
        yield Doubt.MATCH
    if growth is not None and growth.impossible:
        yield Doubt.GROWTH


def growth_of_sure(followed: Sequence[Followed]) -> list[Growth]:
    """Of whom the reference is made: no doubtful match is among them, but where all are."""
    known = [(each.growth, each.doubts) for each in followed if each.growth is not None]
    sure = [growth for growth, doubts in known if not doubts]
    return sure or [growth for growth, _ in known]


def growth_between(fruitlet: FruitletRecord, start: BlockVisit, end: BlockVisit) -> Growth | None:
    """From its two sizes, whatever they are; None where one is not known."""
    before, after = _size(fruitlet, start), _size(fruitlet, end)
    if before is None or after is None:
        return None
    return Growth(before[1], after[1], (after[0] - before[0]).days)


def _size(fruitlet: FruitletRecord, visit: BlockVisit) -> tuple[date, float] | None:
    found = visit.sighting(fruitlet)
    if found is None or found[1].diameter_mm is None:
        return None
    return found[0], found[1].diameter_mm


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


def _outliers(block: BlockRecord, visit: BlockVisit) -> frozenset[tuple[int, str]]:
    """Tag and name of fruitlets whose size the camera got wrong; calipers are taken as read."""
    if block.source is not Source.CAMERA:
        return frozenset()
    sizes = {
        (each.tag_id, each.fruitlet): size[1]
        for each in block.fruitlets
        if (size := _size(each, visit)) is not None
    }
    values = np.array(list(sizes.values()))
    far = OUTLIER_Z * values.std() if sizes else 0.0
    middle = values.mean() if sizes else 0.0
    return frozenset(key for key, mm in sizes.items() if far > 0.0 and abs(mm - middle) >= far)
