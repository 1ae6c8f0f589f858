"""Connections to the database: every one durable, none that waits for ever.

SQLite's defaults differ from build to build, so what matters is set for each
connection and read back.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic, sleep
from typing import Any, TypeVar
from uuid import uuid4

from sqlite_utils import Database

from fieldcam.errors import StorageBusy, StorageDamaged, StorageError, StorageFull
from fieldcam.store.rows.row import from_columns
from fieldcam.words import spelled_out

_Made = TypeVar("_Made")

APPLICATION_ID = 0x66636D31
"""`fcm1` in ASCII: marks a file as fieldcam's."""
BUSY_TIMEOUT_S = 30.0
"""How long a writer waits for other writers."""
WAL_RETRY_S = 0.01
_NO_ROOM_BYTES = 1 << 20
_DAMAGED = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)
_DAMAGED_TEXTS = ("malformed JSON", "Could not decode to UTF-8")
"""Errors that SQLite has no code of its own for."""
_UNWRITABLE = (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM)
_BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


def connect(path: Path, busy_timeout_s: float = BUSY_TIMEOUT_S) -> Database:
    """A connection that may write; the file is made when it is missing.

    One thread at a time uses it; it may be closed by another.
    """
    with storage_errors(path):
        connection = sqlite3.connect(
            path, timeout=busy_timeout_s, isolation_level=None, check_same_thread=False
        )
        database = Database(connection)
        try:
            refuse_foreign(database, path)
            _make_durable(database, path, busy_timeout_s)
        except BaseException:
            database.close()
            raise
    return database


def check_disk(folder: Path) -> None:
    """Raise StorageError where a database could not be kept in this folder.

    Writes one, with a row in its log, and deletes it.
    """
    path = folder / f".probe-{uuid4().hex}.db"
    try:
        database = connect(path)
        try:
            with storage_errors(path):
                database.execute("CREATE TABLE probe (written)")
        finally:
            database.close()
    finally:
        for end in ("", "-wal", "-shm"):
            with suppress(OSError):
                path.with_name(path.name + end).unlink(missing_ok=True)


def connect_read_only(path: Path, busy_timeout_s: float = BUSY_TIMEOUT_S) -> Database:
    """A connection for another process that only looks, also on a read-only disk."""
    if not path.is_file():
        raise StorageError(f"There is no database at {path}.", "Check the data folder's name.")
    with storage_errors(path):
        try:
            return _open_to_read(path, "mode=ro", busy_timeout_s)
        except sqlite3.OperationalError:
            # Without write access to the folder SQLite cannot share a WAL; where none
            # is left over, nobody writes and the file can be read as it is.
            if path.with_name(f"{path.name}-wal").exists():
                raise
            return _open_to_read(path, "immutable=1", busy_timeout_s)


def connect_untouched(path: Path) -> Database:
    """A connection that leaves not even SQLite's own files beside the database.

    Without a log nobody writes; with one, SQLite's index of it may be made.
    """
    how = "mode=ro" if path.with_name(f"{path.name}-wal").exists() else "immutable=1"
    with storage_errors(path):
        return _open_to_read(path, how, BUSY_TIMEOUT_S)


def rows(database: Database, sql: str, *parameters: object) -> list[dict[str, Any]]:
    """All rows of a query, fetched at once so that no read holds the WAL open."""
    with storage_errors(database_path(database)):
        return list(database.query(sql, [storable(each) for each in parameters]))


def rows_as(
    database: Database, kind: type[_Made], sql: str, *parameters: object
) -> tuple[_Made, ...]:
    """The same as dataclasses of the columns that their fields name."""
    return tuple(from_columns(kind, row) for row in rows(database, sql, *parameters))


def storable(value: object) -> object:
    """What SQLite takes: no text that is no UTF-8."""
    return spelled_out(value) if isinstance(value, str) else value


@contextmanager
def writing(database: Database) -> Iterator[None]:
    """One transaction that holds the write lock from its start; joins one that is open."""
    if database.conn.in_transaction:
        yield
        return
    with storage_errors(database_path(database)):
        database.execute("BEGIN IMMEDIATE")
        try:
            yield
            database.execute("COMMIT")
        except BaseException:
            _roll_back(database)
            raise


@contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Turns SQLite's errors about the file into the operator's sentences."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        found = _explained(path, error)
        if found is None:
            raise
        raise found from error


def database_path(database: Database) -> Path:
    """The file behind a connection."""
    # As bytes: a folder may have a name that is no UTF-8.
    sql = "SELECT CAST(file AS BLOB) FROM pragma_database_list WHERE name = 'main'"
    (name,) = database.conn.execute(sql).fetchone()
    return Path(os.fsdecode(name))


def refuse_foreign(database: Database, path: Path) -> None:
    """Raise StorageError for a file of another program, which is left as it is."""
    (owner,) = database.execute("PRAGMA application_id").fetchone()
    (tables,) = database.execute("SELECT count(*) FROM sqlite_schema").fetchone()
    if owner not in (0, APPLICATION_ID) or (owner == 0 and tables):
        raise StorageError(
            f"{path} is not a database of fieldcam.", "Name another folder with --data."
        )


def _roll_back(database: Database) -> None:
    # A full disk has ended the transaction already.
    if database.conn.in_transaction:
        database.execute("ROLLBACK")


def _make_durable(database: Database, path: Path, busy_timeout_s: float) -> None:
    if _switched_to_wal(database, busy_timeout_s) != "wal":
        raise _no_log(path)
    database.execute("PRAGMA synchronous=FULL")
    database.execute("PRAGMA foreign_keys=ON")
    for pragma, wanted in (("synchronous", 2), ("foreign_keys", 1)):
        if database.execute(f"PRAGMA {pragma}").fetchone()[0] != wanted:
            raise StorageError(f"SQLite does not take the setting {pragma} for {path}.")


def _switched_to_wal(database: Database, busy_timeout_s: float) -> str:
    """The journal mode that came of it; SQLite itself does not wait for this switch."""
    deadline_s = monotonic() + busy_timeout_s
    while True:
        try:
            mode: str = database.execute("PRAGMA journal_mode=WAL").fetchone()[0]
            return mode
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF not in _BUSY or monotonic() > deadline_s:
                raise
            sleep(WAL_RETRY_S)


def _open_to_read(path: Path, how: str, busy_timeout_s: float) -> Database:
    uri = f"{path.resolve().as_uri()}?{how}"
    connection = sqlite3.connect(
        uri, uri=True, timeout=busy_timeout_s, isolation_level=None, check_same_thread=False
    )
    try:
        connection.execute("PRAGMA query_only=ON")
        connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()
    except BaseException:
        connection.close()
        raise
    return Database(connection)


_NO_SHARED_MEMORY = (
    sqlite3.SQLITE_IOERR_SHMOPEN,
    sqlite3.SQLITE_IOERR_SHMSIZE,
    sqlite3.SQLITE_IOERR_SHMLOCK,
    sqlite3.SQLITE_IOERR_SHMMAP,
)


def _no_log(path: Path) -> StorageError:
    """As on some cards and network drives."""
    return StorageError(
        f"The disk of {path} cannot keep SQLite's write-ahead log.",
        "Use a data folder on a local disk that is formatted for Linux (ext4).",
    )


def _explained(path: Path, error: sqlite3.DatabaseError) -> StorageError | None:
    """Extended result codes keep their family in the low byte."""
    family = getattr(error, "sqlite_errorcode", 0) & 0xFF
    if family == sqlite3.SQLITE_FULL or (family == sqlite3.SQLITE_IOERR and _no_room(path)):
        return StorageFull(f"No room is left to write {path}.", "Free some space and try again.")
    code = getattr(error, "sqlite_errorcode", 0)
    if code in _NO_SHARED_MEMORY or family == sqlite3.SQLITE_PROTOCOL:
        return _no_log(path)
    if family in _DAMAGED:
        return damaged(path)
    if family in _UNWRITABLE:
        return StorageError(
            f"{path} cannot be written.",
            "Check the data folder's owner and that its disk is not read-only.",
        )
    if family in _BUSY:
        return StorageBusy(f"Another program keeps {path} locked.", "Close it and try again.")
    if any(sign in str(error) for sign in _DAMAGED_TEXTS):
        return StorageDamaged(
            f"A row of the database {path} is damaged.", "`fieldcam recover` finds and mends it."
        )
    if family == sqlite3.SQLITE_IOERR:
        return StorageError(f"The disk gave an error while {path} was used.", "Check the disk.")
    return None


def damaged(path: Path) -> StorageDamaged:
    """The sentence for a database file with damaged pages."""
    return StorageDamaged(
        f"The database {path} is damaged.",
        "`fieldcam recover` keeps it as it is, and makes a new one of what can be read and of the"
        " pictures.",
    )


def _no_room(path: Path) -> bool:
    with suppress(OSError):
        return shutil.disk_usage(path.parent).free < _NO_ROOM_BYTES
    return False
