"""What the growth model works on: each fruitlet of a block, visit by visit.

Calipers and cameras both end here, so that the model knows only one kind of input.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from datetime import date
from enum import StrEnum


class Presence(StrEnum):
    """What became of a fruitlet on one visit."""

    SIZED = "sized"
    SEEN = "seen"
    """It hangs there, but has no size."""
    FALLEN = "fallen"
    """Its place was looked at and is empty, or the operator said so."""
    NOT_SEEN = "not_seen"
    """Its place was hidden, or its cluster was not photographed."""


class SizeSource(StrEnum):
    """Who measured."""

    CAMERA = "camera"
    CALIPERS = "calipers"


@dataclass(frozen=True, slots=True)
class Sighting:
    """What is known of one fruitlet on one visit."""

    presence: Presence
    diameter_mm: float | None = None
    """Exactly where `presence` is SIZED."""
    confidence: float = 1.0
    """That this is the same fruitlet as on the visits before, 0 to 1."""
    sd_mm: float | None = None
    """Standard deviation of the size; None where it is unknown."""


@dataclass(frozen=True, slots=True)
class FruitletRecord:
    """One fruitlet of one tagged cluster over all visits on which something is known of it."""

    tag_id: int
    fruitlet: str
    """Its name in the cluster: "1", "2" ..., or what the caliper table calls it."""
    sightings: Mapping[date, Sighting]

    @property
    def seen_on(self) -> Sequence[tuple[date, Sighting]]:
        """Its sightings by rising days."""
        return sorted(self.sightings.items(), key=lambda entry: entry[0])


def fruit_name(written: str) -> str:
    """One name for one fruit: `fl3` of the authors' workbooks, `3.0` of a spreadsheet and 3."""
    number = _NUMBERED.fullmatch(written.strip())
    return str(int(number[1])) if number else written.strip()


_NUMBERED = re.compile(r"(?:fl[._ ]?)?(\d+)(?:\.0)?", re.ASCII | re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class BlockRecord:
    """All tagged clusters of one variety of one orchard in one season."""

    name: str
    source: SizeSource
    visits: tuple[date, ...]
    """Rising; a block that is walked on two days running has two of them."""
    visited: Mapping[date, frozenset[int]]
    """Tags measured on each visit; a cluster whose fruitlets are all gone is among them."""
    fruitlets: tuple[FruitletRecord, ...]
    tree_of: Mapping[int, str] = field(default_factory=dict)
    """Label of the tree by tag, where it is known."""
    unread: Mapping[date, int] = field(default_factory=dict)
    """Clusters with pictures that were stored and are not read, by their day."""
    undecided: Mapping[date, int] = field(default_factory=dict)
    """Clusters with pictures that were read, none of which was accepted yet, by their day."""


def of_clusters(block: BlockRecord, tags: Set[int]) -> BlockRecord:
    """The block as if only these clusters had been measured."""
    return replace(
        block,
        visited={day: frozenset(visited & tags) for day, visited in block.visited.items()},
        fruitlets=tuple(each for each in block.fruitlets if each.tag_id in tags),
    )
