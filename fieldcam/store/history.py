"""A cluster over the days: every picture with its reading, marks, decision and notes."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any, TypeVar

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.judgements import Action, Answer, MarkKind
from fieldcam.values import ReasonCode, Status
from fieldcam.words import letter_of

_Part = TypeVar("_Part")

_CAPTURES = (
    "SELECT capture.*, visit.day, decision.answer, reading.status, reading.reasons,"
    " reading.tag_read, reading.software_version,"
    " (SELECT living FROM count_now WHERE capture = capture.id) AS living"
    " FROM capture_now AS capture"
    " LEFT JOIN visit_now AS visit ON visit.id = capture.visit"
    " LEFT JOIN decision ON decision.id = capture.decision"
    " LEFT JOIN reading ON reading.id = capture.reading"
)


@dataclass(frozen=True, slots=True)
class FruitletSeen:
    """A fruitlet of a reading, with corrections and marks applied."""

    id: int
    in_target: bool
    living: bool
    """Neither fallen nor struck out as no fruitlet."""
    diameter_mm: float | None
    marks: tuple[MarkKind, ...]


@dataclass(frozen=True, slots=True)
class ReadingSummary:
    """The last reading of a capture, without its masks, clouds and disparity."""

    id: EntryId
    status: Status
    reasons: tuple[ReasonCode, ...]
    tag_read: int | None
    living: int
    """Fruitlets of the target cluster that count, those added by hand included."""
    fruitlets: tuple[FruitletSeen, ...]
    software_version: str
    by_hand_mm: tuple[float | None, ...] = ()
    """Sizes of the fruitlets added by hand; None for one that was only counted."""

    @property
    def target(self) -> tuple[FruitletSeen, ...]:
        """The fruitlets of the tagged cluster."""
        return tuple(fruitlet for fruitlet in self.fruitlets if fruitlet.in_target)

    def letter(self, fruitlet: int) -> str:
        """What every screen calls a fruitlet of this picture; the target's are A, B, C ...

        Numbers are for fruitlets that are followed over days.
        """
        others = (seen for seen in self.fruitlets if not seen.in_target)
        ids = [seen.id for seen in (*self.target, *others)]
        return letter_of(ids.index(fruitlet) if fruitlet in ids else fruitlet)

    @property
    def sizes_mm(self) -> tuple[float, ...]:
        """Of the target's living fruitlets, the smallest first; those added by hand too."""
        seen = (fruitlet.diameter_mm for fruitlet in self.target if fruitlet.living)
        return tuple(sorted(size for size in (*seen, *self.by_hand_mm) if size is not None))


@dataclass(frozen=True, slots=True)
class CaptureRecord:
    """One picture of a cluster."""

    id: EntryId
    visit: EntryId | None
    day: date | None
    taken_at: datetime
    tag_id: int | None
    """The tag that it counts for: corrected, else read or expected."""
    tag_expected: int | None
    view: int
    retake_of: EntryId | None
    action: Action | None
    answer: Answer | None
    decision: EntryId | None
    """The row of `action`, for undoing it."""
    left_file: str
    right_file: str
    reading: ReadingSummary | None
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ClusterMark:
    """Fruitlets of a cluster that a visit's pictures do not show."""

    id: EntryId
    visit: EntryId
    mark: MarkKind
    count: int


def cluster_history(database: Database, block: EntryId, tag_id: int) -> tuple[CaptureRecord, ...]:
    """All pictures of a cluster, the earliest day first."""
    sql = (
        f"{_CAPTURES} WHERE visit.block = ? AND capture.tag_id = ?"
        " AND capture.id IN (SELECT capture FROM tag_candidate WHERE tag_id = ?)"
        " ORDER BY day, turn"
    )
    return tuple(_record(database, row) for row in rows(database, sql, block, tag_id, tag_id))


def visit_captures(database: Database, visit: EntryId) -> tuple[CaptureRecord, ...]:
    """All pictures of a visit, in the order they were taken."""
    sql = f"{_CAPTURES} WHERE capture.visit = ? ORDER BY turn"
    return tuple(_record(database, row) for row in rows(database, sql, visit))


def capture_record(database: Database, capture: EntryId) -> CaptureRecord | None:
    """One picture."""
    found = rows(database, f"{_CAPTURES} WHERE capture.id = ?", capture)
    return _record(database, found[0]) if found else None


def photographed_tags(database: Database, block: EntryId) -> tuple[int, ...]:
    """All clusters of a block of which there are pictures, rising."""
    sql = (
        "SELECT DISTINCT capture.tag_id FROM capture_now AS capture"
        " JOIN visit ON visit.id = capture.visit WHERE visit.block = ?"
        " AND capture.tag_id IS NOT NULL AND capture.action IS NOT 'discard'"
        " ORDER BY capture.tag_id"
    )
    return tuple(row["tag_id"] for row in rows(database, sql, block))


def cluster_marks(database: Database, block: EntryId, tag_id: int) -> tuple[ClusterMark, ...]:
    """Marks on a cluster as a whole, the earliest first."""
    sql = (
        "SELECT mark.* FROM fruitlet_mark_now AS mark JOIN visit ON visit.id = mark.visit"
        " WHERE visit.block = ? AND mark.tag_id = ? ORDER BY mark.turn"
    )
    return tuple(
        ClusterMark(row["id"], row["visit"], MarkKind(row["mark"]), row["count"])
        for row in rows(database, sql, block, tag_id)
    )


def corrected_target(database: Database, reading: EntryId) -> int | None:
    """The cluster of a reading that the operator said is the target; None: as it was read."""
    sql = "SELECT cluster FROM target_correction_now WHERE reading = ?"
    found = rows(database, sql, reading)
    return found[0]["cluster"] if found else None


def notes_on(database: Database, subject: EntryId) -> tuple[str, ...]:
    """Notes about a row, the oldest first."""
    sql = "SELECT text FROM note JOIN standing USING (id) WHERE subject = ? ORDER BY turn"
    return tuple(row["text"] for row in rows(database, sql, subject))


def _record(database: Database, row: dict[str, Any]) -> CaptureRecord:
    return CaptureRecord(
        id=row["id"],
        visit=row["visit"],
        day=_optional(row["day"], date.fromisoformat),
        taken_at=datetime.fromisoformat(row["taken_at"]),
        tag_id=row["tag_id"],
        tag_expected=row["tag_expected"],
        view=row["view"],
        retake_of=row["retake_of"],
        action=_optional(row["action"], Action),
        answer=_optional(row["answer"], Answer),
        decision=row["decision"],
        left_file=row["left_file"],
        right_file=row["right_file"],
        reading=_summary(database, row) if row["reading"] else None,
        notes=notes_on(database, row["id"]),
    )


def _summary(database: Database, row: dict[str, Any]) -> ReadingSummary:
    return ReadingSummary(
        id=row["reading"],
        status=Status(row["status"]),
        reasons=tuple(ReasonCode(code) for code in json.loads(row["reasons"])),
        tag_read=row["tag_read"],
        living=row["living"],
        fruitlets=_fruitlets(database, row["id"], row["reading"]),
        software_version=row["software_version"],
        by_hand_mm=_by_hand(database, row["reading"]),
    )


def _by_hand(database: Database, reading: EntryId) -> tuple[float | None, ...]:
    sql = (
        "SELECT count, diameter_mm FROM fruitlet_mark_now"
        " WHERE reading = ? AND fruitlet IS NULL AND mark = ? ORDER BY turn"
    )
    found = rows(database, sql, reading, MarkKind.ADDED_BY_HAND)
    return tuple(row["diameter_mm"] for row in found for _ in range(row["count"]))


def _fruitlets(database: Database, capture: EntryId, reading: EntryId) -> tuple[FruitletSeen, ...]:
    marks: dict[int, list[MarkKind]] = {}
    sql = "SELECT fruitlet, mark FROM fruitlet_mark_now WHERE reading = ? ORDER BY turn"
    for mark in rows(database, sql, reading):
        if mark["mark"] == MarkKind.KING:
            # A cluster has one king: the last word.
            marks = {seen: [m for m in of if m is not MarkKind.KING] for seen, of in marks.items()}
        marks.setdefault(mark["fruitlet"], []).append(MarkKind(mark["mark"]))
    return tuple(
        FruitletSeen(
            id=row["fruitlet"],
            in_target=bool(row["in_target"]),
            living=bool(row["living"]),
            diameter_mm=row["diameter_mm"],
            marks=tuple(dict.fromkeys(marks.get(row["fruitlet"], []))),
        )
        for row in rows(database, "SELECT * FROM fruitlet_now WHERE capture = ?", capture)
    )


def _optional(value: str | None, decode: Callable[[str], _Part]) -> _Part | None:
    return None if value is None else decode(value)
