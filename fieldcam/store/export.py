"""A copy of the database in one file, for others to open."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from sqlite_utils import Database

from fieldcam.disk.durable import fsync_folder, make_folder, part_of, storage_error
from fieldcam.errors import StorageError
from fieldcam.store.connection import storage_errors


def export_database(database: Database, target: Path) -> None:
    """Write all rows to a new file that needs no write-ahead log beside it."""
    if target.exists():
        raise StorageError(f"{target} is there already.", "Name a file that does not exist.")
    temporary = part_of(target)
    try:
        make_folder(target.parent)
        with storage_errors(target):
            database.execute("VACUUM INTO ?", [str(temporary)])
        with temporary.open("rb") as stream:
            os.fsync(stream.fileno())
        temporary.replace(target)
        fsync_folder(target.parent)
    except OSError as error:
        raise storage_error(target, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
