"""What is left of a data folder, beside what had been announced."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from typing import Self

from fieldcam.store.recovery.integrity import full_check, rehash
from fieldcam.store.recovery.startup import startup_check
from sqlite_utils import Database

from fieldcam.errors import StorageDamaged
from fieldcam.session.events import LiveEvent, Saved
from fieldcam.store.connection import rows
from fieldcam.store.store import Store


@dataclass(slots=True)
class Announced:
    """What the operator was told to be safe."""

    pictures: set[str] = field(default_factory=set)
    rows: int = 0

    def hear(self, line: str) -> None:
        """One line of `announcement`."""
        count, _, key = line.partition(" ")
        self.rows = max(self.rows, int(count))
        if key:
            self.pictures.add(key)


@dataclass(frozen=True, slots=True)
class Losses:
    """All but `pictures` should be nought."""

    pictures: int = 0
    """That had been announced as saved."""
    lost: int = 0
    """Announced pictures, and other announced rows, that are gone."""
    without_image: int = 0
    """Rows whose image file is missing or changed."""
    gaps: int = 0
    """Folders whose rows do not count without a gap."""
    damaged: int = 0
    """Databases that fail SQLite's full check."""

    def __add__(self, other: Self) -> Losses:
        pairs = ((getattr(self, f.name), getattr(other, f.name)) for f in fields(self))
        return Losses(*(a + b for a, b in pairs))

    @property
    def none(self) -> bool:
        return (self.lost, self.without_image, self.gaps, self.damaged) == (0, 0, 0, 0)


def announcement(database: Database, event: LiveEvent) -> str:
    """How many rows are announced with this event, and which picture."""
    count = _count(database)
    return f"{count} {event.capture.key}" if isinstance(event, Saved) else f"{count}"


def missing(database: Database, announced: Announced) -> int:
    """Announced rows that are not there."""
    known = {row["id"] for row in rows(database, "SELECT id FROM capture")}
    return len(announced.pictures - known) + max(0, announced.rows - _count(database))


def inspect(store: Store, announced: Announced) -> Losses:
    """As the app does at its next start, and then every file and row."""
    try:
        startup_check(store)
        full_check(store.database)
    except StorageDamaged:
        return Losses(len(announced.pictures), damaged=1)
    return Losses(
        pictures=len(announced.pictures),
        lost=missing(store.database, announced),
        without_image=len(rehash(store.database, store.objects)),
        gaps=int(_has_gaps(row["seq"] for row in rows(store.database, _SEQUENCE))),
    )


def _count(database: Database) -> int:
    return int(rows(database, "SELECT count(*) AS n FROM entry")[0]["n"])


_SEQUENCE = "SELECT seq FROM entry ORDER BY seq"


def _has_gaps(numbers: Iterable[int]) -> bool:
    found = list(numbers)
    return found != list(range(1, len(found) + 1))
