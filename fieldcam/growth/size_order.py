"""A block as it looks to somebody who cannot tell fruitlets apart but by their sizes.

The growers' way where fruit has no numbers: in each cluster the largest of one visit is
taken for the largest of the next, and so on. The forecast from it stands beside the real one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import date

from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting

_LAST = (Presence.SIZED, Presence.SEEN, Presence.NOT_SEEN, Presence.FALLEN)
"""Whoever has no size comes after those that have one, and what has fallen comes last."""


def in_size_order(block: BlockRecord) -> BlockRecord:
    """The same sizes, with the fruitlets of each cluster called 1 for the largest of each day."""
    clusters: dict[int, list[FruitletRecord]] = {}
    for each in block.fruitlets:
        clusters.setdefault(each.tag_id, []).append(each)
    ranked = (
        FruitletRecord(tag, str(rank), sightings)
        for tag, fruitlets in clusters.items()
        for rank, sightings in enumerate(_ranks(block.visits, fruitlets), start=1)
    )
    return replace(block, fruitlets=tuple(ranked))


def _ranks(days: Sequence[date], fruitlets: Sequence[FruitletRecord]) -> list[dict[date, Sighting]]:
    ranks: list[dict[date, Sighting]] = [{} for _ in fruitlets]
    for day in days:
        known = [each.sightings[day] for each in fruitlets if day in each.sightings]
        for rank, sighting in zip(ranks, sorted(known, key=_order), strict=False):
            # How sure the match by place was says nothing of this one.
            rank[day] = replace(sighting, confidence=1.0)
    return ranks


def _order(sighting: Sighting) -> tuple[int, float]:
    return _LAST.index(sighting.presence), -(sighting.diameter_mm or 0.0)
