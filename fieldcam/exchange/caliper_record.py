"""From the sizes of a caliper table to what the growth model works on.

In a caliper table a fruit without a later size has fallen. One with a later size was
passed over; so was a cluster without any size, when it has a later one, or when so many
clusters have none that the visit was not finished.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date

from fieldcam.exchange.caliper_sizes import CaliperSize
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting, Source
from fieldcam.growth.visits import visits_of

MANY_CLUSTERS, MANY_SHARE = 5, 0.4
"""As many clusters do not lose all their fruit between two visits."""
Sizes = Mapping[tuple[int, str], Mapping[date, float]]
"""By cluster and fruit, then by day; mm."""


def record_of(name: str, sizes: Sequence[CaliperSize]) -> tuple[BlockRecord, tuple[str, ...]]:
    """The block, and what had to be assumed, a sentence each."""
    by_fruit = _by_fruit(sizes)
    said = {
        (each.cluster, each.fruit, each.day): each.presence
        for each in sizes
        if each.presence is not None
    }
    trees = {each.cluster: each.tree for each in sizes if each.tree}
    if said:
        return _as_said(name, by_fruit, said, trees), ()
    return record_of_sizes(name, by_fruit, trees)


def record_of_sizes(
    name: str, sizes: Sizes, trees: Mapping[int, str]
) -> tuple[BlockRecord, tuple[str, ...]]:
    """The same from sizes alone; fruits without any are left out."""
    days = sorted({day for by_day in sizes.values() for day in by_day})
    visited, notes = _visited(sizes, days)
    fruitlets = tuple(
        FruitletRecord(cluster, fruit, _sightings(by_day, cluster, visited))
        for (cluster, fruit), by_day in sorted(sizes.items(), key=lambda item: _order(item[0]))
        if by_day
    )
    return BlockRecord(name, Source.CALIPERS, tuple(days), visited, fruitlets, dict(trees)), notes


def _by_fruit(sizes: Sequence[CaliperSize]) -> dict[tuple[int, str], dict[date, float]]:
    found: dict[tuple[int, str], dict[date, float]] = {}
    for each in sizes:
        by_day = found.setdefault((each.cluster, each.fruit), {})
        if each.diameter_mm is not None:
            by_day[each.day] = each.diameter_mm
    return found


def _visited(
    sizes: Sizes, days: Sequence[date]
) -> tuple[dict[date, frozenset[int]], tuple[str, ...]]:
    """Whoever was measured on one of a visit's neighbouring days is not missing on the other."""
    sized: dict[date, set[int]] = {day: set() for day in days}
    for (cluster, _), by_day in sizes.items():
        for day in by_day:
            sized[day].add(cluster)
    visited = {day: frozenset(clusters) for day, clusters in sized.items()}
    last = {cluster: day for day in days for cluster in sized[day]}
    notes, alive, empty = [], set[int](), set[int]()
    for visit in visits_of(BlockRecord("", Source.CALIPERS, tuple(days), visited, ())):
        missing = {cluster for cluster in alive if last[cluster] < visit.first}
        if len(missing) >= max(MANY_CLUSTERS, MANY_SHARE * len(alive)):
            notes.append(
                f"On {visit} {len(missing)} of {len(alive)} clusters have no size at all: they are"
                " taken as not measured, and their fruit as not seen, not as fallen."
            )
            missing = set()
        alive = (alive | visit.clusters) - missing
        empty |= missing
        visited[visit.days[-1]] |= empty
    return visited, tuple(notes)


def _sightings(
    by_day: Mapping[date, float], cluster: int, visited: Mapping[date, frozenset[int]]
) -> dict[date, Sighting]:
    first, last = min(by_day), max(by_day)
    found = {}
    for day, clusters in visited.items():
        if day in by_day:
            found[day] = Sighting(Presence.SIZED, by_day[day])
        elif day > first and cluster in clusters:
            found[day] = Sighting(Presence.FALLEN if day > last else Presence.NOT_SEEN)
    return found


def _as_said(
    name: str,
    sizes: Sizes,
    said: Mapping[tuple[int, str, date], Presence],
    trees: Mapping[int, str],
) -> BlockRecord:
    """The table says itself what became of each fruit."""
    days = sorted({day for *_, day in said})
    fruitlets = tuple(
        FruitletRecord(
            cluster,
            fruit,
            {
                day: Sighting(said[cluster, fruit, day], by_day.get(day))
                for day in days
                if (cluster, fruit, day) in said
            },
        )
        for (cluster, fruit), by_day in sorted(sizes.items(), key=lambda item: _order(item[0]))
    )
    visited = {
        day: frozenset(
            cluster
            for (cluster, _, on), presence in said.items()
            if on == day and presence is not Presence.NOT_SEEN
        )
        for day in days
    }
    return BlockRecord(name, Source.CALIPERS, tuple(days), visited, fruitlets, dict(trees))


def _order(key: tuple[int, str]) -> tuple[int, bool, int, str]:
    """Clusters by number, then fruits as a person would sort them."""
    cluster, fruit = key
    number = int(fruit) if fruit.isascii() and fruit.isdigit() else 0
    return cluster, not number, number, fruit
