"""A data folder opened only to look at it, beside the app that writes it.

Nothing is made, migrated or locked: reads are short, and a reader of a write-ahead
log never holds up the writer.
"""

from __future__ import annotations

import os
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from sqlite_utils import Database

from fieldcam.errors import StorageDamaged, StorageError
from fieldcam.store.connection import connect_read_only, rows
from fieldcam.store.folder import DataFolder, known_data_folder
from fieldcam.store.migrations import check_version, steps, version_of
from fieldcam.store.objects import Objects
from fieldcam.store.private_copy import PrivateCopy
from fieldcam.store.recovery.lost_rows import check_rows
from fieldcam.store.seals import DamagedReading, damaged_readings
from fieldcam.store.space import Space
from fieldcam.store.store import DATABASE_NAME

BUSY_TIMEOUT_S = 1.0
"""A screen says that it has to wait, rather than stand still."""


class ReadableStore(Protocol):
    """What is needed to look at a walk; `Store` has it too."""

    @property
    def folder(self) -> DataFolder: ...
    @property
    def objects(self) -> Objects: ...
    @property
    def space(self) -> Space: ...
    @property
    def database(self) -> Database: ...


@dataclass(frozen=True, slots=True)
class ReadOnlyStore:
    """`open_read_only` makes one; one thread at a time uses it."""

    folder: DataFolder
    objects: Objects
    space: Space
    database: Database
    damaged: tuple[DamagedReading, ...] = ()
    """Readings that are not what was written, and count as if they were not there."""
    _copy: PrivateCopy | None = None

    def changes(self) -> int:
        """Another number after each change by others."""
        return int(rows(self.database, "PRAGMA data_version")[0]["data_version"])

    def file_id(self) -> int:
        """Another number when what was opened is there no more; raises OSError where it is gone.

        A copy is outdated by each change.
        """
        file = self.folder.path / DATABASE_NAME
        if self._copy is None:
            return file.stat().st_ino
        log = file.with_name(f"{file.name}-wal")
        files = (file, log) if log.exists() else (file,)
        return hash(tuple((each.stat().st_ino, each.stat().st_mtime_ns) for each in files))

    def close(self) -> None:
        self.database.close()
        if self._copy is not None:
            self._copy.close()


def open_read_only(path: Path) -> ReadOnlyStore:
    """Raises a StorageError where there is nothing that this version can read."""
    folder, file = known_data_folder(path), path / DATABASE_NAME
    check_rows(path, DATABASE_NAME)
    copy = None if _is_readable(file) else PrivateCopy(file)
    database = connect_read_only(file, BUSY_TIMEOUT_S) if copy is None else copy.database
    try:
        check_form(database, file)
        damaged = damaged_readings(database)
        if damaged and copy is None:
            database.close()
            copy = PrivateCopy(file)
            database = copy.database
        if damaged and copy is not None:
            copy.leave_out(damaged)
    except BaseException:
        database.close()
        if copy is not None:
            copy.close()
        raise
    return ReadOnlyStore(folder, Objects(path), Space(path), database, damaged, copy)


def check_form(database: Database, file: Path) -> None:
    """Raises a StorageError where the file is not of this version's form."""
    check_version(database, file)
    if version_of(database) < len(steps()):
        raise StorageError(
            f"{file} was written by an older fieldcam.", "Open it with this version's app once."
        )


def _is_readable(file: Path) -> bool:
    """Whether a copy is no help: on a disk that takes no writing an old form stays as it is."""
    if not file.is_file() or os.access(file.parent, os.W_OK):
        return True
    try:
        with closing(connect_read_only(file, BUSY_TIMEOUT_S)) as database:
            return version_of(database) >= len(steps())
    except StorageDamaged:
        return True
    except StorageError:
        return False
