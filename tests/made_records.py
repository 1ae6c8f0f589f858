"""Small blocks written down by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date, timedelta

from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting, SizeSource

FIRST = date(2026, 5, 10)
FALLEN, NOT_SEEN, SEEN = Presence.FALLEN, Presence.NOT_SEEN, Presence.SEEN
Known = float | Presence | None
"""A size, or what else is known; None for nothing."""


def on(day: int) -> date:
    return FIRST + timedelta(days=day)


def made_fruitlet(tag: int, name: str, known: Mapping[int, Known]) -> FruitletRecord:
    """By day from 0 on."""
    return FruitletRecord(
        tag, name, {on(day): _sighting(what) for day, what in known.items() if what is not None}
    )


def _sighting(what: float | Presence) -> Sighting:
    if isinstance(what, Presence):
        return Sighting(what)
    return Sighting(Presence.SIZED, what)


def made_block(
    fruitlets: Sequence[FruitletRecord], source: SizeSource = SizeSource.CALIPERS
) -> BlockRecord:
    """Visited wherever something is known."""
    days = sorted({day for each in fruitlets for day in each.sightings})
    visited = {
        day: frozenset(each.tag_id for each in fruitlets if day in each.sightings) for day in days
    }
    return BlockRecord("Gala", source, tuple(days), visited, tuple(fruitlets))


def fast_ones(count: int = 20, rate: float = 1.0, days: int = 4) -> list[FruitletRecord]:
    """Fruitlets of cluster 1 with one rate, from 8 mm on."""
    return [made_fruitlet(1, f"fast {i}", {0: 8.0, days: 8.0 + rate * days}) for i in range(count)]
