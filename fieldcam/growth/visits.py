"""One visit of a block: its clusters once, on one day or on neighbouring ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, timedelta

from fieldcam.errors import BadInput
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting
from fieldcam.words import number_of

MIN_DAYS = 3
"""Shorter intervals lie inside what calipers themselves scatter (paper, Data Collection)."""
MAX_REPEATED = 0.5
"""Share of clusters that may be taken again the day after without making it a new visit."""


@dataclass(frozen=True, slots=True)
class BlockVisit:
    """All that was measured of a block in one go."""

    days: tuple[date, ...]
    """Rising and neighbouring."""
    clusters: frozenset[int]

    @property
    def first(self) -> date:
        return self.days[0]

    def __str__(self) -> str:
        """Such as 2026-05-14, or 2026-05-14/15 for neighbouring days (ISO 8601, intervals)."""
        first, last = self.days[0].isoformat(), self.days[-1].isoformat()
        if first == last:
            return first
        shared = 8 if first[:8] == last[:8] else 5 if first[:5] == last[:5] else 0
        return f"{first}/{last[shared:]}"

    def sighting(self, fruitlet: FruitletRecord) -> tuple[date, Sighting] | None:
        """What is known of a fruitlet: its last size, else the last that is known at all."""
        known = [(day, fruitlet.sightings[day]) for day in self.days if day in fruitlet.sightings]
        sized = [entry for entry in known if entry[1].presence is Presence.SIZED]
        return next(reversed(sized or known), None)


def visits_of(block: BlockRecord) -> tuple[BlockVisit, ...]:
    """The visits of a block, in order.

    A day belongs to the visit of the day before when few of its clusters were measured then.
    """
    visits: list[BlockVisit] = []
    for day in block.visits:
        clusters = block.visited.get(day, frozenset())
        if visits and _continues(visits[-1], day, clusters):
            before = visits.pop()
            visits.append(BlockVisit((*before.days, day), before.clusters | clusters))
        elif clusters:
            visits.append(BlockVisit((day,), clusters))
    return tuple(visits)


def _continues(visit: BlockVisit, day: date, clusters: frozenset[int]) -> bool:
    again = len(clusters & visit.clusters)
    fewer = min(len(clusters), len(visit.clusters))
    return day - visit.days[-1] == timedelta(days=1) and again < MAX_REPEATED * max(fewer, 1)


def intervals(visits: Sequence[BlockVisit]) -> Iterator[tuple[BlockVisit, BlockVisit]]:
    """For each visit after the first: the one that it is best compared with, and itself.

    That is the latest at least MIN_DAYS before it, else the one just before it.
    """
    for place, end in enumerate(visits[1:], start=1):
        long_ago = [v for v in visits[:place] if (end.first - v.first).days >= MIN_DAYS]
        yield (long_ago or [visits[place - 1]])[-1], end


def chosen_interval(
    block: BlockRecord, start: date | None = None, end: date | None = None
) -> tuple[date, date]:
    """First days of the two visits that a forecast is made from.

    `end` is the newest where it is not named, `start` the one that it is best compared with.
    Raises BadInput when there are not two visits, or none on a day that is named.
    """
    visits = visits_of(block)
    if len(visits) < 2:
        raise BadInput(
            f"Block {block.name} has {_counted(visits)}; growth needs two.",
            unread_pictures(block)
            or undecided_pictures(block)
            or f"Measure it {_still_to_do(visits)}.",
        )
    last = visits[-1] if end is None else visit_on(block, end)
    if start is not None:
        return visit_on(block, start).first, last.first
    if last == visits[0]:
        raise BadInput(f"Block {block.name} has no visit before that of {last}.")
    return next(before.first for before, after in intervals(visits) if after == last), last.first


def visit_on(block: BlockRecord, day: date) -> BlockVisit:
    """The visit that a day belongs to; raises BadInput when there was none."""
    visits = visits_of(block)
    for visit in visits:
        if day in visit.days:
            return visit
    days = ", ".join(map(str, visits)) or "never"
    raise BadInput(f"Block {block.name} was not measured on {day}.", f"Its visits: {days}.")


def unread_pictures(block: BlockRecord) -> str | None:
    """A sentence on what was photographed and is not known yet; None where all was read."""
    if not block.unread:
        return None
    return f"{_pictures_of(block.unread, 'not read')}: nothing is known of them yet."


def undecided_pictures(block: BlockRecord) -> str | None:
    """A sentence on what was read and not accepted yet; None where all was decided."""
    if not block.undecided:
        return None
    return f"{_pictures_of(block.undecided, 'read, but not accepted')}: they are left out."


def _pictures_of(clusters: Mapping[date, int], how: str) -> str:
    days = ", ".join(f"{count} on {day}" for day, count in sorted(clusters.items()))
    return (
        f"Pictures of {number_of(sum(clusters.values()), 'cluster')} are stored and {how} ({days})"
    )


def _still_to_do(visits: Sequence[BlockVisit]) -> str:
    if visits:
        return f"again at least {MIN_DAYS} days later"
    return f"twice, at least {MIN_DAYS} days apart"


def _counted(visits: Sequence[BlockVisit]) -> str:
    return f"only the visit of {visits[0]}" if visits else "no visit"
