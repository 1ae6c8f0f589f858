"""Brings a database file up to the present schema; never back.

Each file `sql/<n>_<name>.sql` is one step and one transaction, counted by
`user_version`; after the last one the views are renewed.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path

from sqlite_utils import Database

from fieldcam.errors import DatabaseTooNew
from fieldcam.store.connection import (
    APPLICATION_ID,
    refuse_foreign,
    storage_errors,
    writing,
)
from fieldcam.store.views import renew_views, stale_views


@cache
def steps() -> tuple[str, ...]:
    """The SQL text of each step, the first one first."""
    found = [f for f in (files("fieldcam.store") / "sql").iterdir() if f.name.endswith(".sql")]
    ordered = sorted(found, key=lambda file: int(file.name.split("_")[0]))
    return tuple(file.read_text(encoding="utf-8") for file in ordered)


def migrate(database: Database, path: Path) -> int:
    """Apply the steps that are missing; the version that the file has now."""
    check_version(database, path)
    for version in range(version_of(database) + 1, len(steps()) + 1):
        _apply(database, version)
    renew_views(database)
    return version_of(database)


def check_version(database: Database, path: Path) -> None:
    """Refuse files of other programs and of newer versions of this one."""
    with storage_errors(path):
        refuse_foreign(database, path)
        version = version_of(database)
    if version > len(steps()):
        raise DatabaseTooNew(
            f"{path} was written by a newer fieldcam (form {version};"
            f" this one knows forms up to {len(steps())}).",
            "Update fieldcam on this machine.",
        )


def version_of(database: Database) -> int:
    """How many steps the file has been through."""
    return int(database.execute("PRAGMA user_version").fetchone()[0])


def is_present(database: Database) -> bool:
    """Whether the file is of this version's form, views included."""
    return version_of(database) >= len(steps()) and not stale_views(database)


def _apply(database: Database, version: int) -> None:
    with writing(database):
        # Another process may have done this step while this one waited for the lock.
        if version_of(database) >= version:
            return
        for statement in statements(steps()[version - 1]):
            database.execute(statement)
        _forbid_changes(database)
        database.execute(f"PRAGMA application_id={APPLICATION_ID}")
        database.execute(f"PRAGMA user_version={version}")


def statements(script: str) -> Iterator[str]:
    """The single statements of a script; `executescript` would end the transaction."""
    pending = ""
    for line in script.splitlines(keepends=True):
        pending += line
        if sqlite3.complete_statement(pending):
            yield pending
            pending = ""


def _forbid_changes(database: Database) -> None:
    for table in database.table_names():
        for action in ("UPDATE", "DELETE"):
            database.execute(
                f"CREATE TRIGGER IF NOT EXISTS no_{action.lower()}_of_{table}"
                f" BEFORE {action} ON {table} BEGIN"
                f" SELECT RAISE(ABORT, 'rows of {table} are never changed'); END"
            )
