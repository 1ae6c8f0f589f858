"""Single rows by their id."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sqlite_utils import Database

from fieldcam.errors import StorageError
from fieldcam.store.connection import connect_read_only, rows
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.orchard import Setting


def row_of(database: Database, table: str, key: EntryId) -> dict[str, Any]:
    """The row with this id."""
    found = rows(database, f"SELECT * FROM {table} WHERE id = ?", key)
    if not found:
        raise StorageError(f"There is no {table} {key} in the database.")
    return found[0]


def cards_of(database_path: Path, capture: EntryId) -> float | None:
    """Side of a tag's black square in mm in the capture's block, where that is set up."""
    sql = (
        "SELECT value FROM block_setting_now AS said JOIN visit ON visit.block = said.block"
        " JOIN capture ON capture.visit = visit.id"
        " WHERE capture.id = ? AND said.tree IS NULL AND said.name = ?"
    )
    database = connect_read_only(database_path)
    try:
        found = rows(database, sql, capture, Setting.TAG_SIZE_MM)
    finally:
        database.close()
    return found[0]["value"] if found else None


def capture_facts(database_path: Path, key: EntryId) -> dict[str, Any]:
    """A capture's row, through a connection of its own."""
    database = connect_read_only(database_path)
    try:
        return row_of(database, "capture", key)
    finally:
        database.close()
