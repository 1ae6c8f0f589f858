"""Clusters whose fruitlets have names in their pictures, so that who is who is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date

from fieldcam.growth.association.points import points_of
from fieldcam.growth.places import ClusterVisit, MatchWord, Place, SeenFruitlet
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting
from fieldcam.growth.size_rule import SizeRule, sighting_of


@dataclass(frozen=True, slots=True, eq=False)
class NamedCluster:
    """A cluster, and which fruit of the calipers its fruitlets are."""

    tag_id: int
    visits: tuple[ClusterVisit, ...]
    names: Mapping[Place, str]
    """By a person, or by the simulator. In a picture that has names, whoever has none is no
    fruit that has one."""
    words: tuple[MatchWord, ...] = ()
    """The operator's, on who is who over days."""
    out_of_sight: frozenset[tuple[str, date]] = frozenset()
    """Fallen fruit whose place no picture of the day shows, so that they cannot tell; as far as
    that is known, in simulations."""

    @property
    def unnamed(self) -> int:
        """Fruitlets of its pictures that have no name there."""
        shown = [s.place for visit in self.visits for v in visit.views for s in points_of(v).seen]
        return sum(place not in self.names for place in shown)

    def seen_on(self, day: date) -> dict[str, list[SeenFruitlet]]:
        """What the pictures of a visit show of each named fruit."""
        found: dict[str, list[SeenFruitlet]] = {}
        for visit in self.visits:
            for seen in (s for v in visit.views if visit.day == day for s in points_of(v).seen):
                if seen.place in self.names:
                    found.setdefault(self.names[seen.place], []).append(seen)
        return found


def fruit_of(calipers: BlockRecord, tag_id: int) -> dict[str, FruitletRecord]:
    """What calipers know of one cluster, by the fruits' names."""
    return {f.fruitlet: f for f in calipers.fruitlets if f.tag_id == tag_id}


def known_records(
    cluster: NamedCluster, calipers: Mapping[str, FruitletRecord]
) -> tuple[FruitletRecord, ...]:
    """The camera's sizes with known association: by name, and on each visit the better known.

    A fruit that no picture shows has fallen where the calipers say so, and else is not seen.
    """
    sightings: dict[str, dict[date, Sighting]] = {}
    for visit in cluster.visits:
        shown = cluster.seen_on(visit.day)
        for name in sorted({*sightings, *shown}):
            sightings.setdefault(name, {})[visit.day] = (
                sighting_of(shown[name], SizeRule.BETTER_KNOWN)
                if name in shown
                else Sighting(_fate(calipers.get(name), visit.day))
            )
    return tuple(FruitletRecord(cluster.tag_id, name, days) for name, days in sightings.items())


def _fate(fruit: FruitletRecord | None, day: date) -> Presence:
    known = None if fruit is None else fruit.sightings.get(day)
    fallen = known is not None and known.presence is Presence.FALLEN
    return Presence.FALLEN if fallen else Presence.NOT_SEEN
