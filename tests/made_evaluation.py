"""Clusters with named fruitlets, and what calipers say of them, for tests of evaluation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date, timedelta

from made_clusters import FIRST_DAY, made_view, made_visit, ring

from fieldcam.growth.evaluation.named import NamedCluster
from fieldcam.growth.places import ClusterVisit, Place
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting, SizeSource

Sizes = Mapping[str, float | None]
"""By the fruit's name; None where it has fallen."""


def day(number: int) -> date:
    """Day 0 is that of the first visit."""
    return FIRST_DAY + timedelta(days=number)


def caliper_fruit(tag_id: int, name: str, sizes: Mapping[int, float | None]) -> FruitletRecord:
    """Sizes by day; None from the day on which it had fallen."""
    return FruitletRecord(
        tag_id,
        name,
        {
            day(k): Sighting(Presence.FALLEN) if mm is None else Sighting(Presence.SIZED, mm)
            for k, mm in sizes.items()
        },
    )


def caliper_block(fruitlets: Sequence[FruitletRecord], days: Sequence[int] = (0, 4)) -> BlockRecord:
    tags = frozenset(f.tag_id for f in fruitlets)
    visits = tuple(day(k) for k in days)
    every = dict.fromkeys(visits, tags)
    return BlockRecord("North", SizeSource.CALIPERS, visits, every, tuple(fruitlets))


def named_cluster(
    tag_id: int, visits: Mapping[int, Sequence[Sequence[float | None]]], names: str = "abcdef"
) -> NamedCluster:
    """For each day the sizes of each picture; fruitlet k of the ring is called names[k].

    A NaN takes a fruitlet out of a picture, None leaves it without a size.
    """
    called: dict[Place, str] = {}
    made: list[ClusterVisit] = []
    for number, pictures in visits.items():
        views = []
        for k, sizes in enumerate(pictures):
            reading = f"{tag_id}/{number}/{k}"
            shown = [s for s in ring(sizes) if s.diameter_mm is None or s.diameter_mm > 0]
            views.append(made_view(reading, shown))
            called |= {Place(reading, s.id): names[s.id] for s in shown if names[s.id] != "?"}
        made.append(made_visit(number, *views))
    return NamedCluster(tag_id, tuple(made), called)
