"""Appends rows, each call in one transaction; nothing is ever changed or deleted.

Numbers are given while the write lock is held, so that many processes may write
at once and a device's rows still count without a gap.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sqlite_utils import Database

from fieldcam.store.clock import Moment, now, utc_text
from fieldcam.store.connection import database_path, storable, storage_errors, writing
from fieldcam.store.rows.row import Draft, EntryId, Row, columns, new_id

Clock = Callable[[], Moment]


def append(
    database: Database,
    device: EntryId,
    *rows: Row | Draft,
    who: EntryId | None = None,
    why: str | None = None,
    clock: Clock = now,
) -> tuple[EntryId, ...]:
    """Write rows in one transaction and give their ids; when this returns, they are durable."""
    drafts = [row if isinstance(row, Draft) else Draft(row, new_id()) for row in rows]
    with writing(database):
        seq, turn = _next_numbers(database, device)
        written_at = clock()
        for offset, draft in enumerate(drafts):
            entry = {
                "id": draft.id,
                "kind": draft.row.table,
                "device": device,
                "seq": seq + offset,
                "turn": turn + offset,
                "who": who,
                "why": why,
                **_when(draft.at or written_at),
            }
            insert(database, "entry", entry)
            insert(database, draft.row.table, {"id": draft.id, **columns(draft.row)})
    return tuple(draft.id for draft in drafts)


def changes(database: Database) -> tuple[int, ...]:
    """Another value after each change of the rows, whichever connection made it.

    The last turn is among them since a transaction that is rolled back changes only that.
    """
    with storage_errors(database_path(database)):
        (others,) = database.execute("PRAGMA data_version").fetchone()
        (turn,) = database.execute("SELECT max(turn) FROM entry").fetchone()
    return others, database.conn.total_changes, turn or 0


def insert(database: Database, table: str, values: dict[str, Any]) -> None:
    """One row, given by its columns."""
    places = ", ".join(f":{name}" for name in values)
    sql = f"INSERT INTO {table} ({', '.join(values)}) VALUES ({places})"
    database.execute(sql, {name: storable(value) for name, value in values.items()})


def _next_numbers(database: Database, device: EntryId) -> tuple[int, int]:
    sql = "SELECT max(seq) FROM entry WHERE device = ?"
    (seq,) = database.execute(sql, [device]).fetchone()
    (turn,) = database.execute("SELECT max(turn) FROM entry").fetchone()
    return (seq or 0) + 1, (turn or 0) + 1


def _when(at: Moment) -> dict[str, Any]:
    return {
        "at_utc": utc_text(at.utc),
        "utc_offset_min": at.utc_offset_min,
        "boot": at.boot,
        "boot_ns": at.boot_ns,
    }
