"""Whether stored readings are what was written: each has a checksum of its own row.

A damaged one is left out, by an Undo as any row, and its picture is read again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from sqlite_utils import Database

from fieldcam.errors import ReadingDamaged
from fieldcam.store.connection import database_path, rows, storage_errors
from fieldcam.store.journal import append
from fieldcam.store.rows.judgements import Undo
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import SEALED_COLUMNS, seal

WHY = "it was damaged"
_MAX_NAMED = 5
# Damage may have made a text what is none, which SQLite would refuse to give as such.
_COLUMNS = ", ".join(
    f"CASE typeof({name}) WHEN 'text' THEN CAST({name} AS BLOB) ELSE {name} END AS {name}"
    for name in (*SEALED_COLUMNS, "sha256")
)
_SOUND = "sha256 IS NOT NULL OR " + " AND ".join(
    f"json_valid({name})" for name in ("document", "sizes", "reasons", "models")
)
"""Of a row without a checksum; of others the checksum tells."""


@dataclass(frozen=True, slots=True)
class DamagedReading:
    """A reading that is not what was written."""

    id: EntryId
    picture: str
    """Such as `tag 17 on 19 May 2026, view 1`."""


def damaged_readings(database: Database) -> tuple[DamagedReading, ...]:
    """All that count and are damaged; reads every reading, about 1 s for 1,000."""
    return tuple(_named(database, key) for key in _damaged(database))


def leave_out(database: Database, device: EntryId, found: Sequence[DamagedReading]) -> None:
    """Let them count no more, so that their pictures have no reading."""
    if found:
        append(database, device, *(Undo(each.id) for each in found), why=WHY)


def damage_sentence(found: Sequence[DamagedReading]) -> str:
    """What was left out; empty where nothing was."""
    if not found:
        return ""
    named = "; ".join(each.picture for each in found[:_MAX_NAMED])
    more = f"; and {len(found) - _MAX_NAMED} more" if len(found) > _MAX_NAMED else ""
    return f"Damaged readings were left out: {named}{more}."


def sealed_document(database: Database, key: EntryId) -> str:
    """The document of a reading; raises ReadingDamaged where its row is not what was written."""
    found = _rows(database, f"SELECT {_COLUMNS}, ({_SOUND}) AS sound FROM reading", key)
    if not all(_is_sound(row) for row in found):
        raise damaged(database, key)
    # Without a row there is none to be damaged.
    return found[0]["document"].decode() if found else ""


def damaged(database: Database, key: EntryId) -> ReadingDamaged:
    """The sentence about a damaged reading."""
    return ReadingDamaged(
        f"The reading of {_named(database, key).picture} is damaged.",
        "`fieldcam recover` reads its picture again.",
        key,
    )


def _damaged(database: Database) -> Iterator[EntryId]:
    sql = f"SELECT id, {_COLUMNS}, ({_SOUND}) AS sound FROM reading JOIN standing USING (id)"
    with storage_errors(database_path(database)):
        for row in database.query(sql):
            if not _is_sound(row):
                yield row["id"]


def _rows(database: Database, select: str, key: EntryId) -> list[dict[str, Any]]:
    return rows(database, f"{select} WHERE id = ?", key)


def _is_sound(row: dict[str, Any]) -> bool:
    written = row["sha256"]
    if written is None:
        return bool(row["sound"])
    return bool(written == seal(row[name] for name in SEALED_COLUMNS).encode())


def _named(database: Database, key: EntryId) -> DamagedReading:
    sql = (
        "SELECT capture.view, capture.tag_expected, correction.tag_id,"
        " coalesce(visit.day, capture.taken_at) AS day"
        " FROM reading JOIN capture ON capture.id = reading.capture"
        " LEFT JOIN visit ON visit.id = capture.visit"
        " LEFT JOIN tag_correction_now AS correction ON correction.capture = capture.id"
        " WHERE reading.id = ?"
    )
    found = rows(database, sql, key)
    if not found:
        return DamagedReading(key, "an unknown picture")
    row = found[0]
    tag_id = row["tag_expected"] if row["tag_id"] is None else row["tag_id"]
    day: date = datetime.fromisoformat(row["day"]).date()
    what = "a new tag" if tag_id is None else f"tag {tag_id}"
    return DamagedReading(key, f"{what} on {day:%d %b %Y}, view {row['view']}")
