"""A cluster, and a block, day by day: what was taken, and which sizes count."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date
from itertools import groupby

from sqlite_utils import Database

from fieldcam.store.blocks import visits
from fieldcam.store.connection import rows
from fieldcam.store.durations import VisitTimes, visit_times
from fieldcam.store.history import (
    CaptureRecord,
    ClusterMark,
    cluster_history,
    cluster_marks,
    visit_captures,
)
from fieldcam.store.judgement_rows import Action
from fieldcam.store.rows import EntryId
from fieldcam.store.walks import ClusterState, walk_route


@dataclass(frozen=True, slots=True)
class ClusterDay:
    """One visit of a cluster."""

    visit: EntryId
    day: date
    pictures: tuple[CaptureRecord, ...]
    """In the order they were taken; retakes, second views and discarded ones too."""
    marks: tuple[ClusterMark, ...]
    """On fruitlets that no picture of this day shows."""

    @property
    def counted(self) -> CaptureRecord | None:
        """The picture whose sizes count on this day."""
        return counted(self.pictures)

    @property
    def sizes_mm(self) -> tuple[float, ...]:
        """Of the picture that counts, the smallest first."""
        reading = None if self.counted is None else self.counted.reading
        return () if reading is None else reading.sizes_mm


@dataclass(frozen=True, slots=True)
class BlockDay:
    """One visit of a block."""

    visit: EntryId
    day: date
    sizes_mm: tuple[float, ...]
    """Of all clusters with an accepted picture, the smallest first."""
    accepted: int
    """Clusters."""
    retaken: int
    """Pictures that the operator wanted taken again."""
    skipped: int
    """Clusters."""
    unread: int
    """Pictures without a reading."""
    times: VisitTimes


def cluster_days(database: Database, block: EntryId, tag_id: int) -> tuple[ClusterDay, ...]:
    """All visits on which something is known of a cluster, the earliest first."""
    pictures: dict[EntryId | None, list[CaptureRecord]] = {}
    for record in cluster_history(database, block, tag_id):
        pictures.setdefault(record.visit, []).append(record)
    marks = cluster_marks(database, block, tag_id)
    found = []
    for visit in visits(database, block):
        here = tuple(mark for mark in marks if mark.visit == visit.id)
        if visit.id in pictures or here:
            taken = tuple(pictures.get(visit.id, ()))
            found.append(ClusterDay(visit.id, visit.day, taken, here))
    return tuple(found)


def photographed_tags(database: Database, block: EntryId) -> tuple[int, ...]:
    """All clusters of a block of which there are pictures, rising."""
    sql = (
        "SELECT DISTINCT capture.tag_id FROM capture_now AS capture"
        " JOIN visit_now AS visit ON visit.id = capture.visit WHERE visit.block = ?"
        " AND capture.tag_id IS NOT NULL AND capture.action IS NOT 'discard'"
        " ORDER BY capture.tag_id"
    )
    return tuple(row["tag_id"] for row in rows(database, sql, block))


def block_days(database: Database, block: EntryId) -> tuple[BlockDay, ...]:
    """All visits of a block on which a picture was taken, the earliest first."""
    taken = (visit for visit in visits(database, block) if visit.captures)
    return tuple(_block_day(database, visit.id, visit.day) for visit in taken)


def counted(pictures: Iterable[CaptureRecord]) -> CaptureRecord | None:
    """Of one cluster on one day: the accepted picture with most fruitlets, else none."""
    accepted = [record for record in pictures if record.action is Action.ACCEPT]
    # Of several that show as many fruitlets the last one counts.
    return max(reversed(accepted), key=_living, default=None)


def _block_day(database: Database, visit: EntryId, day: date) -> BlockDay:
    pictures = visit_captures(database, visit)
    by_tag = groupby(sorted(pictures, key=_tag), key=_tag)
    sizing = [counted(tuple(taken)) for tag_id, taken in by_tag if tag_id >= 0]
    accepted = [record for record in sizing if record is not None]
    readings = [record.reading for record in accepted]
    states = [stop.state for stop in walk_route(database, visit).stops]
    return BlockDay(
        visit=visit,
        day=day,
        sizes_mm=tuple(sorted(size for r in readings if r is not None for size in r.sizes_mm)),
        accepted=len(accepted),
        retaken=sum(record.action is Action.RETAKE for record in pictures),
        skipped=states.count(ClusterState.SKIPPED),
        unread=sum(p.reading is None and p.action is not Action.DISCARD for p in pictures),
        times=visit_times(database, visit),
    )


def _living(record: CaptureRecord) -> int:
    return -1 if record.reading is None else record.reading.living


def _tag(record: CaptureRecord) -> int:
    return -1 if record.tag_id is None else record.tag_id
