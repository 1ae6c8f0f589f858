"""From the sizes of a caliper table to what the growth model works on.

Blank, a word for fallen and a word for not measured are three things. A fruit whose later cells
are blank has fallen, unless the table has a word for that. One with a later size was passed over;
so was a cluster without any size, when it has a later one, or when so many clusters have none
that the visit was not finished.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date

from fieldcam.exchange.calipers.sizes import FruitOnDay
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting, SizeSource
from fieldcam.growth.visits import BlockVisit, visits_of
from fieldcam.words import number_of

MANY_CLUSTERS, MANY_SHARE = 5, 0.4
"""As many clusters do not lose all their fruit between two visits."""
Fruit = tuple[int, str]
"""Cluster and name."""
Sizes = Mapping[Fruit, Mapping[date, float]]
"""mm."""


@dataclass(frozen=True, slots=True)
class _Said:
    """What the table says in words, by fruit and day."""

    words: Mapping[Fruit, Mapping[date, Presence]] = field(default_factory=dict)

    @property
    def blank_is_fallen(self) -> bool:
        """Who writes that fruit has fallen leaves no cell blank for it."""
        return not any(Presence.FALLEN in by_day.values() for by_day in self.words.values())

    def days_of(self, presence: Presence) -> Iterator[tuple[int, date]]:
        """Clusters and days of which a word says this."""
        for (cluster, _), by_day in self.words.items():
            yield from ((cluster, day) for day, said in by_day.items() if said is presence)


def record_of(name: str, sizes: Sequence[FruitOnDay]) -> tuple[BlockRecord, tuple[str, ...]]:
    """The block, and what had to be assumed, a sentence each."""
    by_fruit: dict[Fruit, dict[date, float]] = {}
    said: dict[Fruit, dict[date, Presence]] = {}
    for each in sizes:
        fruit = each.cluster, each.fruit
        by_day = by_fruit.setdefault(fruit, {})
        if each.diameter_mm is not None:
            by_day[each.day] = each.diameter_mm
        if each.presence is not None:
            said.setdefault(fruit, {})[each.day] = each.presence
    trees = {each.cluster: each.tree for each in sizes if each.tree}
    record, notes = _of_words(name, by_fruit, said, trees)
    return _with_certainties(record, sizes), notes


def _of_words(
    name: str,
    by_fruit: Sizes,
    said: Mapping[Fruit, Mapping[date, Presence]],
    trees: Mapping[int, str],
) -> tuple[BlockRecord, tuple[str, ...]]:
    if any(Presence.SIZED in by_day.values() for by_day in said.values()):
        return _as_said(name, by_fruit, said, trees), ()
    return _record(name, by_fruit, _Said(said), trees)


def _with_certainties(record: BlockRecord, sizes: Sequence[FruitOnDay]) -> BlockRecord:
    """As far as the table says how sure the camera's matches are."""
    known = {
        (each.cluster, each.fruit, each.day): each.certainty
        for each in sizes
        if each.certainty < 1.0
    }
    if not known:
        return record
    return replace(record, fruitlets=tuple(_with_certainty(f, known) for f in record.fruitlets))


def _with_certainty(
    fruitlet: FruitletRecord, known: Mapping[tuple[int, str, date], float]
) -> FruitletRecord:
    sightings = {
        day: replace(seen, confidence=known.get((fruitlet.tag_id, fruitlet.fruitlet, day), 1.0))
        for day, seen in fruitlet.sightings.items()
    }
    return replace(fruitlet, sightings=sightings)


def record_of_sizes(name: str, sizes: Sizes, trees: Mapping[int, str]) -> BlockRecord:
    """The same from sizes alone; fruits without any are left out."""
    return _record(name, sizes, _Said(), trees)[0]


def _record(
    name: str, sizes: Sizes, said: _Said, trees: Mapping[int, str]
) -> tuple[BlockRecord, tuple[str, ...]]:
    days = sorted({day for by_day in sizes.values() for day in by_day})
    visited, unfinished = _visited(sizes, said, days)
    fruitlets = tuple(
        FruitletRecord(fruit[0], fruit[1], _sightings(by_day, fruit, said, visited))
        for fruit, by_day in sorted(sizes.items(), key=lambda item: _order(item[0]))
        if by_day
    )
    block = BlockRecord(name, SizeSource.CALIPERS, tuple(days), visited, fruitlets, dict(trees))
    return block, (*unfinished, *_blank_notes(block, said))


def _visited(
    sizes: Sizes, said: _Said, days: Sequence[date]
) -> tuple[dict[date, frozenset[int]], tuple[str, ...]]:
    """Whoever was measured on one of a visit's neighbouring days is not missing on the other."""
    looked_at: dict[date, set[int]] = {day: set() for day in days}
    for (cluster, _), by_day in sizes.items():
        for day in by_day:
            looked_at[day].add(cluster)
    for cluster, day in said.days_of(Presence.FALLEN):
        looked_at.setdefault(day, set()).add(cluster)
    visited = {day: frozenset(clusters) for day, clusters in sorted(looked_at.items())}
    if not said.blank_is_fallen:
        return visited, ()
    return _with_emptied(visited, set(said.days_of(Presence.NOT_SEEN)))


def _with_emptied(
    visited: dict[date, frozenset[int]], passed_over: set[tuple[int, date]]
) -> tuple[dict[date, frozenset[int]], tuple[str, ...]]:
    """A cluster that has no size any more was looked at, and all its fruit had fallen."""
    last = {cluster: day for day, clusters in visited.items() for cluster in clusters}
    notes, alive, empty = [], set[int](), set[int]()
    for visit in visits_of(BlockRecord("", SizeSource.CALIPERS, tuple(visited), visited, ())):
        missing = {cluster for cluster in alive if last[cluster] < visit.first}
        missing -= {cluster for cluster in missing if _passed_over(cluster, visit, passed_over)}
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


def _passed_over(cluster: int, visit: BlockVisit, passed_over: set[tuple[int, date]]) -> bool:
    return any((cluster, day) in passed_over for day in visit.days)


def _sightings(
    by_day: Mapping[date, float],
    fruit: Fruit,
    said: _Said,
    visited: Mapping[date, frozenset[int]],
) -> dict[date, Sighting]:
    words = said.words.get(fruit, {})
    fell = min((day for day, word in words.items() if word is Presence.FALLEN), default=None)
    first, last = min(by_day), max(by_day)
    found = {}
    for day, clusters in visited.items():
        if day in by_day:
            found[day] = Sighting(Presence.SIZED, by_day[day])
        elif fell is not None and day >= fell:
            found[day] = Sighting(Presence.FALLEN)
        elif day in words:
            found[day] = Sighting(words[day])
        elif day > first and fruit[0] in clusters:
            gone = day > last and said.blank_is_fallen
            found[day] = Sighting(Presence.FALLEN if gone else Presence.NOT_SEEN)
    return found


def _blank_notes(block: BlockRecord, said: _Said) -> Iterator[str]:
    """How blank cells were taken that no later size explains."""
    gone = Counter[date]()
    for each in block.fruitlets:
        words = said.words.get((each.tag_id, each.fruitlet), {})
        last = max(day for day, seen in each.sightings.items() if seen.presence is Presence.SIZED)
        later = [day for day in block.visits if day > last]
        if later and not any(day in words for day in later):
            gone[later[0]] += each.sightings.get(later[0]) is not None
    days = ", ".join(f"{number} on {day}" for day, number in sorted(gone.items()) if number)
    if not days:
        return
    counted = f"{number_of(gone.total(), 'fruit')} ({days})"
    if said.blank_is_fallen:
        yield (
            f"Without a size to the end, and so taken as fallen: {counted}. Where one was only"
            " passed over, write not measured in its cell."
        )
    else:
        yield (
            "Blank to the end where others are said to have fallen, and so taken as not measured:"
            f" {counted}."
        )


def _as_said(
    name: str,
    sizes: Sizes,
    said: Mapping[Fruit, Mapping[date, Presence]],
    trees: Mapping[int, str],
) -> BlockRecord:
    """The table says itself, in columns of states, what became of each fruit."""
    days = sorted({day for by_day in said.values() for day in by_day})
    fruitlets = tuple(
        FruitletRecord(
            fruit[0],
            fruit[1],
            {
                day: Sighting(presence, by_day.get(day))
                for day, presence in sorted(said.get(fruit, {}).items())
            },
        )
        for fruit, by_day in sorted(sizes.items(), key=lambda item: _order(item[0]))
    )
    visited: dict[date, set[int]] = {day: set() for day in days}
    for (cluster, _), by_day in said.items():
        for day, presence in by_day.items():
            if presence is not Presence.NOT_SEEN:
                visited[day].add(cluster)
    clusters = {day: frozenset(found) for day, found in visited.items()}
    return BlockRecord(name, SizeSource.CALIPERS, tuple(days), clusters, fruitlets, dict(trees))


def _order(key: Fruit) -> tuple[int, bool, int, str]:
    """Clusters by number, then fruits as a person would sort them."""
    cluster, fruit = key
    number = int(fruit) if fruit.isascii() and fruit.isdigit() else 0
    return cluster, not number, number, fruit
