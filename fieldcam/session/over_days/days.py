"""A cluster, and a block, day by day: what was taken, and the sizes that growth has of it.

`store.queries.counted` says which pictures count, and `growth.tracking` which size of a
fruitlet that two of them show: what screens tell of a day is what stands behind the forecast.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import groupby

from sqlite_utils import Database

from fieldcam.growth.records import Presence, Sighting
from fieldcam.session.over_days.growing import (
    ClusterRows,
    block_rows,
    cluster_rows,
    followed_cluster,
    tracks_of,
)
from fieldcam.store.queries.blocks import visits
from fieldcam.store.queries.durations import VisitTimes, visit_times
from fieldcam.store.queries.history import (
    CaptureRecord,
    ClusterMark,
    cluster_history,
    cluster_marks,
    visit_captures,
)
from fieldcam.store.queries.walks import ClusterState, walk_route
from fieldcam.store.rows.judgements import Action
from fieldcam.store.rows.row import EntryId

MAX_KNOWN = 1000


@dataclass(frozen=True, slots=True)
class ShownDay:
    """What the pictures that count show of a cluster on one day, as growth takes it."""

    fruitlets: int
    """Living ones, those added by hand too."""
    sizes_mm: tuple[float, ...]
    """The smallest first."""


@dataclass(frozen=True, slots=True)
class ClusterDay:
    """One visit of a cluster."""

    visit: EntryId
    day: date
    pictures: tuple[CaptureRecord, ...]
    """In the order they were taken; retakes, second views and discarded ones too."""
    marks: tuple[ClusterMark, ...]
    """On fruitlets that no picture of this day shows."""
    counted: tuple[CaptureRecord, ...] = ()
    """Those whose sizes count, two at most; none where no picture was accepted."""
    fruitlets: int = 0
    """Living ones that they show."""
    sizes_mm: tuple[float, ...] = ()
    """Of these, the smallest first."""


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
    rows = cluster_rows(database, block, tag_id)
    found = []
    for visit in visits(database, block):
        here = tuple(mark for mark in marks if mark.visit == visit.id)
        if visit.id in pictures or here:
            taken = tuple(pictures.get(visit.id, ()))
            counted = _counted(rows, visit.day, taken)
            shown = _shown(database, rows, visit.day, counted)
            found.append(
                ClusterDay(
                    visit.id, visit.day, taken, here, counted, shown.fruitlets, shown.sizes_mm
                )
            )
    return tuple(found)


def block_days(database: Database, block: EntryId) -> tuple[BlockDay, ...]:
    """All visits of a block on which a picture was taken, the earliest first."""
    rows = {each.tag_id: each for each in block_rows(database, block)}
    taken = (visit for visit in visits(database, block) if visit.captures)
    return tuple(_block_day(database, visit.id, visit.day, rows) for visit in taken)


def _block_day(
    database: Database, visit: EntryId, day: date, rows: Mapping[int, ClusterRows]
) -> BlockDay:
    pictures = visit_captures(database, visit)
    by_tag = groupby(sorted(pictures, key=_tag), key=_tag)
    sizes: list[float] = []
    for tag_id, taken in by_tag:
        if tag_id in rows:
            counted = _counted(rows[tag_id], day, tuple(taken))
            sizes += _shown(database, rows[tag_id], day, counted).sizes_mm
    states = [stop.state for stop in walk_route(database, visit).stops]
    return BlockDay(
        visit=visit,
        day=day,
        sizes_mm=tuple(sorted(sizes)),
        accepted=len({p.tag_id for p in pictures if p.action is Action.ACCEPT} - {None}),
        retaken=sum(record.action is Action.RETAKE for record in pictures),
        skipped=states.count(ClusterState.SKIPPED),
        unread=sum(p.reading is None and p.action is not Action.DISCARD for p in pictures),
        times=visit_times(database, visit),
    )


def _counted(
    rows: ClusterRows, day: date, pictures: Sequence[CaptureRecord]
) -> tuple[CaptureRecord, ...]:
    """Of one visit: where a day has two of them, those of the other one stand there."""
    ids = {
        picture.capture for visit in rows.visits if visit.day == day for picture in visit.pictures
    }
    return tuple(picture for picture in pictures if picture.id in ids)


def _shown(
    database: Database, rows: ClusterRows, day: date, counted: Sequence[CaptureRecord]
) -> ShownDay:
    readings = [picture.reading for picture in counted if picture.reading is not None]
    if len(readings) < 2:
        return ShownDay(
            sum(reading.living for reading in readings),
            tuple(size for reading in readings for size in reading.sizes_mm),
        )
    by_hand = max((reading.by_hand_mm for reading in readings), key=len)
    sizes = _followed(database, rows)[day]
    sized = [size for size in (*sizes, *by_hand) if size is not None]
    return ShownDay(len(sizes) + len(by_hand), tuple(sorted(sized)))


_known: dict[ClusterRows, Mapping[date, Sequence[float | None]]] = {}
"""Rows never change, and following takes long."""


def _followed(database: Database, rows: ClusterRows) -> Mapping[date, Sequence[float | None]]:
    """Each living fruitlet of a day, with its size where it has one."""
    if rows not in _known:
        if len(_known) >= MAX_KNOWN:
            _known.clear()
        tracks = tracks_of(followed_cluster(database, rows))
        _known[rows] = {
            visit.day: _living(
                track.visits[visit.day].sighting for track in tracks if visit.day in track.visits
            )
            for visit in rows.visits
        }
    return _known[rows]


def _living(sightings: Iterable[Sighting]) -> list[float | None]:
    here = (Presence.SIZED, Presence.SEEN)
    return [each.diameter_mm for each in sightings if each.presence in here]


def _tag(record: CaptureRecord) -> int:
    return -1 if record.tag_id is None else record.tag_id
