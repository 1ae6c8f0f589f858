"""The pictures that growth is computed from, and what the operator said about them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import date
from typing import Any

from sqlite_utils import Database

from fieldcam.store.connection import rows, rows_as
from fieldcam.store.queries.blocks import visits
from fieldcam.store.rows.fruit import AssociationWord, MissingWord
from fieldcam.store.rows.judgements import MarkKind
from fieldcam.store.rows.row import EntryId

MAX_VIEWS = 2
"""Pictures of a cluster that count on one visit."""
_TARGET_AREA = (
    "SELECT coalesce(sum(json_extract(size.value, '$.area_px')), 0)"
    " FROM reading, json_each(reading.sizes) AS size"
    " JOIN fruitlet_now AS fruitlet ON fruitlet.capture = capture.id"
    " AND fruitlet.fruitlet = json_extract(size.value, '$.id')"
    " WHERE reading.id = capture.reading AND fruitlet.in_target AND fruitlet.living"
)


@dataclass(frozen=True, slots=True)
class CountedPicture:
    """An accepted picture with a reading."""

    capture: EntryId
    reading: EntryId
    cluster: int | None
    """The target cluster, where the operator corrected it."""
    living: int
    area_px: int
    """Of all visible pixels of the target's living fruitlets; 0 where an early version read it."""
    struck_out: frozenset[int]
    """Fruitlets of the reading that are none."""
    fallen: frozenset[int]
    """Fruitlets of the reading that the operator saw fall since."""


@dataclass(frozen=True, slots=True)
class CountedVisit:
    """A cluster on one visit on which something was accepted or marked."""

    tag_id: int
    day: date
    pictures: tuple[CountedPicture, ...]
    """At most two, those with the greatest segmented area of the target cluster (paper, "Robot
    Experiment"), in the order they were taken."""
    fallen: int
    """Fruitlets since the visit before, besides those that a picture shows."""
    hidden: int
    """Fruitlets that hang there where no picture shows them, those added by hand too."""
    told: tuple[MissingWord, ...] = ()
    """Which of the fallen and hidden are which."""


def counted_visits(
    database: Database, block: EntryId, tag_id: int | None = None
) -> tuple[CountedVisit, ...]:
    """Of one cluster or of all, by tag and then by day."""
    pictures: dict[tuple[int, str], list[CountedPicture]] = {}
    for row in _accepted(database, block, tag_id):
        pictures.setdefault((row["tag_id"], row["day"]), []).append(_picture(database, row))
    marks = _cluster_marks(database, block, tag_id)
    told = _told(database, block, tag_id)
    return tuple(
        replace(
            _visit(database, *key, pictures.get(key, []), marks.get(key, {})),
            told=tuple(told.get(key, ())),
        )
        for key in sorted({*pictures, *marks})
    )


def missing_words(
    database: Database, visit: EntryId, tag_id: int | None = None
) -> tuple[MissingWord, ...]:
    """What stands of one visit, the oldest first; of one cluster or of all."""
    sql = "SELECT * FROM missing_word_now WHERE visit = ? AND coalesce(tag_id = ?, 1) ORDER BY turn"
    return rows_as(database, MissingWord, sql, visit, tag_id)


def unread_clusters(database: Database, block: EntryId) -> dict[date, int]:
    """How many clusters of a day have pictures without a reading, by rising days.

    Pictures whose tag nobody knows before they are read count as one cluster each.
    """
    found = rows(
        database,
        "SELECT visit.day, count(DISTINCT coalesce(capture.tag_id, capture.id)) AS clusters"
        " FROM capture_now AS capture JOIN visit_now AS visit ON visit.id = capture.visit"
        " WHERE visit.block = ? AND capture.reading IS NULL"
        " AND coalesce(capture.action, 'accept') = 'accept'"
        " GROUP BY visit.day ORDER BY visit.day",
        block,
    )
    return {date.fromisoformat(row["day"]): row["clusters"] for row in found}


def undecided_clusters(database: Database, block: EntryId) -> dict[date, int]:
    """How many clusters of a day have pictures that were read and wait for a
    decision, and none that was accepted; by rising days.

    Pictures that show no tag count as one cluster each.
    """
    found = rows(
        database,
        "SELECT day, count(*) AS clusters FROM ("
        " SELECT visit.day AS day FROM capture_now AS capture"
        " JOIN visit_now AS visit ON visit.id = capture.visit"
        " WHERE visit.block = ? AND capture.reading IS NOT NULL"
        " GROUP BY visit.day, coalesce(capture.tag_id, capture.id)"
        " HAVING max(capture.action IS NULL) AND NOT max(capture.action IS 'accept')"
        ") GROUP BY day ORDER BY day",
        block,
    )
    return {date.fromisoformat(row["day"]): row["clusters"] for row in found}


def association_words(
    database: Database, readings: Iterable[EntryId]
) -> tuple[AssociationWord, ...]:
    """What stands about pairs of these readings, the oldest first."""
    sql = (
        "WITH here AS (SELECT value FROM json_each(?))"
        " SELECT * FROM association_word_now"
        " WHERE one_reading IN here AND other_reading IN here ORDER BY turn, id"
    )
    return rows_as(database, AssociationWord, sql, json.dumps(sorted(readings)))


def _accepted(database: Database, block: EntryId, tag_id: int | None) -> list[dict[str, Any]]:
    only = ""
    which: tuple[int, ...] = ()
    if tag_id is not None:
        only = (
            " AND capture.tag_id = ?"
            " AND capture.id IN (SELECT capture FROM tag_candidate WHERE tag_id = ?)"
        )
        which = (tag_id, tag_id)
    sql = (
        "SELECT visit.day, capture.tag_id, capture.id AS capture, capture.reading,"
        " (SELECT cluster FROM target_correction_now WHERE reading = capture.reading) AS cluster,"
        " (SELECT living FROM count_now WHERE capture = capture.id) AS living,"
        f" ({_TARGET_AREA}) AS area_px"
        " FROM capture_now AS capture JOIN visit_now AS visit ON visit.id = capture.visit"
        " WHERE visit.block = ? AND capture.action = 'accept'"
        f" AND capture.reading IS NOT NULL AND capture.tag_id IS NOT NULL{only}"
        " ORDER BY visit.day, capture.turn"
    )
    return rows(database, sql, block, *which)


def _picture(database: Database, row: dict[str, Any]) -> CountedPicture:
    sql = "SELECT fruitlet, mark FROM fruitlet_mark_now WHERE reading = ? AND fruitlet IS NOT NULL"
    marks = rows(database, sql, row["reading"])
    marked = {
        kind: frozenset(mark["fruitlet"] for mark in marks if mark["mark"] == kind)
        for kind in (MarkKind.NOT_A_FRUITLET, MarkKind.FALLEN)
    }
    return CountedPicture(
        capture=row["capture"],
        reading=row["reading"],
        cluster=row["cluster"],
        living=row["living"],
        area_px=row["area_px"],
        struck_out=marked[MarkKind.NOT_A_FRUITLET],
        fallen=marked[MarkKind.FALLEN],
    )


def _cluster_marks(
    database: Database, block: EntryId, tag_id: int | None
) -> dict[tuple[int, str], dict[str, int]]:
    """How many fruitlets no picture of a visit shows, by kind of mark."""
    sql = (
        "SELECT mark.tag_id, visit.day, mark.mark, sum(mark.count) AS fruitlets"
        " FROM fruitlet_mark_now AS mark JOIN visit_now AS visit ON visit.id = mark.visit"
        " WHERE visit.block = ? AND coalesce(mark.tag_id = ?, 1)"
        " GROUP BY mark.tag_id, visit.day, mark.mark"
    )
    found: dict[tuple[int, str], dict[str, int]] = {}
    for row in rows(database, sql, block, tag_id):
        found.setdefault((row["tag_id"], row["day"]), {})[row["mark"]] = row["fruitlets"]
    return found


def _told(
    database: Database, block: EntryId, tag_id: int | None
) -> dict[tuple[int, str], list[MissingWord]]:
    """By tag and day."""
    found: dict[tuple[int, str], list[MissingWord]] = {}
    for visit in visits(database, block):
        for word in missing_words(database, visit.id, tag_id):
            found.setdefault((word.tag_id, visit.day.isoformat()), []).append(word)
    return found


def _visit(
    database: Database,
    tag_id: int,
    day: str,
    pictures: Sequence[CountedPicture],
    marks: dict[str, int],
) -> CountedVisit:
    # Of several that show as much the later ones count.
    most_first = sorted(reversed(pictures), key=lambda p: (-p.area_px, -p.living))
    best = most_first[:MAX_VIEWS]
    kept = tuple(picture for picture in pictures if picture in best)
    added = max((_added(database, picture.reading) for picture in kept), default=0)
    return CountedVisit(
        tag_id,
        date.fromisoformat(day),
        kept,
        fallen=marks.get(MarkKind.FALLEN, 0),
        hidden=marks.get(MarkKind.HIDDEN, 0) + added,
    )


def _added(database: Database, reading: EntryId) -> int:
    sql = (
        "SELECT coalesce(sum(count), 0) AS added FROM fruitlet_mark_now"
        " WHERE reading = ? AND fruitlet IS NULL AND mark = 'added_by_hand'"
    )
    return int(rows(database, sql, reading)[0]["added"])
