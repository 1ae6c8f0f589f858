"""What pictures cost, which camera took them, and the newest of their readings."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlite_utils import Database

from fieldcam.store.connection import rows, rows_as
from fieldcam.store.rows.row import EntryId

NEWEST = 20
"""Pictures whose mean is taken."""


@dataclass(frozen=True, slots=True)
class LastCamera:
    """The head that took the last picture."""

    left_serial: str
    right_serial: str
    taken_at: datetime


def bytes_per_capture(database: Database) -> float | None:
    """What the last pictures took on the disk, readings included; None before the first."""
    sql = (
        "SELECT avg(bytes) AS mean FROM (SELECT left_bytes + right_bytes"
        " + coalesce((SELECT max(length(document)) FROM reading WHERE capture = capture.id), 0)"
        " AS bytes FROM capture JOIN entry USING (id) ORDER BY turn DESC LIMIT ?)"
    )
    mean: float | None = rows(database, sql, NEWEST)[0]["mean"]
    return mean


def last_camera(database: Database) -> LastCamera | None:
    """None where no picture came from a camera that says its serial numbers."""
    sql = (
        "SELECT left_serial, right_serial, taken_at FROM capture JOIN entry USING (id)"
        " WHERE left_serial <> '' ORDER BY turn DESC LIMIT 1"
    )
    return next(iter(rows_as(database, LastCamera, sql)), None)


def newest_readings(database: Database, count: int) -> tuple[EntryId, ...]:
    """The last readings in which a tag was read, the newest first."""
    sql = (
        "SELECT reading.id FROM reading JOIN entry USING (id) WHERE tag_read IS NOT NULL"
        " ORDER BY turn DESC LIMIT ?"
    )
    return tuple(row["id"] for row in rows(database, sql, count))
