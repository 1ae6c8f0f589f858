"""Single rows by their id."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sqlite_utils import Database

from fieldcam.errors import StorageError
from fieldcam.store.connection import connect_read_only, rows
from fieldcam.store.rows import EntryId


def row_of(database: Database, table: str, key: EntryId) -> dict[str, Any]:
    """The row with this id."""
    found = rows(database, f"SELECT * FROM {table} WHERE id = ?", key)
    if not found:
        raise StorageError(f"There is no {table} {key} in the database.")
    return found[0]


def capture_facts(database_path: Path, key: EntryId) -> dict[str, Any]:
    """A capture's row, through a connection of its own."""
    database = connect_read_only(database_path)
    try:
        return row_of(database, "capture", key)
    finally:
        database.close()
