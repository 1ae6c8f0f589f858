"""What association works on: a cluster's fruitlets in space, picture by picture."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from enum import StrEnum

from fieldcam.growth.records import Sighting
from fieldcam.growth.size_rule import SizeRule
from fieldcam.values import ClusterReading, Points


class Association(StrEnum):
    """How a cluster's fruitlets are followed from one picture to another."""

    GEOMETRY = "geometry"
    PAPER = "paper"
    SIZE_ORDER = "size-order"

    @property
    def size_rule(self) -> SizeRule:
        """Which size it takes where nobody chose another rule."""
        return SizeRule.LARGER if self is Association.PAPER else SizeRule.BETTER_KNOWN


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """One fruitlet in one reading."""

    reading: str
    fruitlet: int
    """`Fruitlet.id` in that reading."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenFruitlet:
    """One fruitlet of the target cluster in one picture."""

    place: Place
    diameter_mm: float | None
    sd_mm: float | None
    """Standard deviation of the diameter; None where it is unknown."""
    center_mm: tuple[float, float, float]
    """Middle of the fruitlet in the camera frame of its picture."""
    cloud_mm: Points


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One picture of a cluster on one visit; its reading says what it can decide."""

    id: str
    """Of the reading, in the store."""
    reading: ClusterReading
    struck_out: frozenset[int] = frozenset()
    """Fruitlets of the reading that the operator said are none."""
    fallen: frozenset[int] = frozenset()
    """Fruitlets of the reading that the operator saw fall since."""
    cluster: int | None = None
    """The target cluster (`Fruitlet.cluster`), where the operator corrected it."""


@dataclass(frozen=True, slots=True, eq=False)
class ClusterVisit:
    """All that was photographed of one cluster on one visit, and what the operator marked."""

    day: date
    views: tuple[View, ...]
    fallen: int = 0
    """Fruitlets that the operator said have fallen since the visit before."""
    hidden: int = 0
    """Fruitlets that the operator said hang there, hidden."""
    said_fallen: frozenset[Place] = frozenset()
    """Which of them have fallen, as an earlier picture shows them."""
    said_hidden: frozenset[Place] = frozenset()


@dataclass(frozen=True, slots=True)
class MatchWord:
    """The operator's word: the fruitlet at `one` is the fruitlet at `other`, or is none there."""

    one: Place
    other: Place | None
    not_in: str | None = None
    """Where `other` is None: the reading that does not show it."""


@dataclass(frozen=True, slots=True)
class TrackedVisit:
    """One fruitlet on one visit."""

    sighting: Sighting
    places: tuple[Place, ...]
    """In each of the visit's pictures that show it."""
    by_hand: bool = False
    """The operator's word made or confirmed the match."""


@dataclass(frozen=True, slots=True)
class Track:
    """One fruitlet of a cluster, followed over the visits."""

    number: int
    """1, 2 ... in the order of first sight, the largest first."""
    visits: dict[date, TrackedVisit]
    """For every visit of the cluster from the first on which the fruitlet was seen."""
