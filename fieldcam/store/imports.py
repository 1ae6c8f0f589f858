"""What the store knows of a pair of files that is brought to it from elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.judgements import Action
from fieldcam.store.rows.walk import ObjectRole


@dataclass(frozen=True, slots=True)
class KnownPair:
    """A capture whose two files are these."""

    capture: EntryId
    block_name: str
    day: date | None
    tag_expected: int | None
    """None: taken up from files that a crash had left without a row."""
    discarded: bool
    analysed: bool

    @property
    def stands(self) -> bool:
        """Whether it counts for a cluster; what was only taken up after a crash does not."""
        return self.tag_expected is not None and not self.discarded

    def is_of(self, block_name: str, day: date, tag_id: int) -> bool:
        """Whether it counts for this cluster on this day."""
        return (self.block_name, self.day, self.tag_expected) == (block_name, day, tag_id)


def known_pairs(database: Database, left: str, right: str) -> tuple[KnownPair, ...]:
    """All captures of these two files, the oldest first."""
    found = rows(
        database,
        "SELECT capture.id, capture.action, capture.reading, capture.tag_expected,"
        " visit.day, block.name FROM capture_now AS capture"
        " LEFT JOIN visit_now AS visit ON visit.id = capture.visit"
        " LEFT JOIN block ON block.id = visit.block"
        " WHERE capture.left_file = ? AND capture.right_file = ? ORDER BY capture.turn",
        left,
        right,
    )
    return tuple(
        KnownPair(
            capture=row["id"],
            block_name=row["name"] or "",
            day=None if row["day"] is None else date.fromisoformat(row["day"]),
            tag_expected=row["tag_expected"],
            discarded=row["action"] == Action.DISCARD,
            analysed=row["reading"] is not None,
        )
        for row in found
    )


def has_calibration(database: Database, file: str) -> bool:
    """Whether a row says that this file under `objects/` is a calibration."""
    sql = "SELECT 1 FROM object_file WHERE file = ? AND role = ?"
    return bool(rows(database, sql, file, ObjectRole.CALIBRATION))


def has_cluster(database: Database, block: EntryId, tag_id: int) -> bool:
    """Whether the block is known to have this tag."""
    sql = "SELECT 1 FROM cluster_now WHERE block = ? AND tag_id = ?"
    return bool(rows(database, sql, block, tag_id))


def is_untouched(database: Database, visit: EntryId) -> bool:
    """Whether nothing happened on a visit yet."""
    sql = "SELECT 1 FROM capture WHERE visit = ? UNION SELECT 1 FROM event WHERE visit = ?"
    return not rows(database, sql, visit, visit)


def failed_alike(database: Database, capture: EntryId, cause: str, message: str) -> bool:
    """Whether the analysis of a capture is known to fail in this way."""
    sql = "SELECT 1 FROM analysis_failure WHERE capture = ? AND cause = ? AND message = ?"
    return bool(rows(database, sql, capture, cause, message))
