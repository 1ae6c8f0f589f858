"""A data folder opened only to look at it, beside the app that writes it.

Nothing is made, migrated or locked: reads are short, and a reader of a write-ahead
log never holds up the writer.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from sqlite_utils import Database

from fieldcam.errors import StorageError
from fieldcam.store.connection import connect_read_only, rows
from fieldcam.store.folder import DataFolder, known_data_folder
from fieldcam.store.migrations import check_version, steps, version_of
from fieldcam.store.objects import Objects
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

    def changes(self) -> int:
        """Another number after each change by others."""
        return int(rows(self.database, "PRAGMA data_version")[0]["data_version"])

    def file_id(self) -> int:
        """Another number when the file was replaced; raises OSError where it is gone."""
        return (self.folder.path / DATABASE_NAME).stat().st_ino

    def close(self) -> None:
        self.database.close()


def open_read_only(path: Path) -> ReadOnlyStore:
    """Raises a StorageError where there is nothing that this version can read."""
    folder, file = known_data_folder(path), path / DATABASE_NAME
    database = connect_read_only(file, BUSY_TIMEOUT_S)
    try:
        check_version(database, file)
        if version_of(database) < len(steps()):
            raise StorageError(
                f"{file} was written by an older fieldcam.",
                "Open it with this version's app once.",
            )
    except BaseException:
        database.close()
        raise
    return ReadOnlyStore(folder, Objects(path), Space(path), database)
