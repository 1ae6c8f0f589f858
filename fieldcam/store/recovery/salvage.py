"""Rows of a damaged database, as far as they can be read, taken over into a new one.

SQLite's own `.recover` is tried first, where its command is installed: it reads the pages
themselves. Each row is taken over with its id and its who, when and why, in the order in
which rows were written, so that none stands without the one that it rests on.
"""

from __future__ import annotations

import shutil
import sqlite3
import subprocess
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sqlite_utils import Database

from fieldcam.store.journal import insert

COMMAND = "sqlite3"
DEADLINE_S = 600.0
_LOG = "-wal"
_REPLACED = "\ufffd"
"""Stands for bytes that are no text."""
Row = dict[str, Any]


def readable_copy(damaged: Path, folder: Path) -> Database:
    """A copy in `folder` of what can be read of a database; the file itself is left alone."""
    copy = folder / damaged.name
    for path in (damaged, damaged.with_name(damaged.name + _LOG)):
        if path.exists():
            shutil.copyfile(path, folder / path.name)
    recovered = _recovered(copy, folder / "recovered.db")
    connection = sqlite3.connect(recovered or copy, isolation_level=None)
    # A text that damage made none is told by its row's checks, not by a refusal to read.
    connection.text_factory = lambda content: content.decode("utf-8", errors="replace")
    return Database(connection)


def _recovered(copy: Path, target: Path) -> Path | None:
    """What `.recover` makes of it; None where that is not installed, or fails."""
    command = shutil.which(COMMAND)
    if command is None:
        return None
    start = [command, "-batch", "-init", "/dev/null"]
    try:
        told = subprocess.run(
            [*start, str(copy), ".recover"], capture_output=True, timeout=DEADLINE_S, check=False
        )
        subprocess.run(
            [*start, str(target)],
            input=told.stdout, capture_output=True, timeout=DEADLINE_S, check=False,
        )  # fmt: skip
        with sqlite3.connect(target) as database:
            found = database.execute("SELECT count(*) FROM entry").fetchone()[0]
    except (subprocess.TimeoutExpired, sqlite3.DatabaseError, OSError):
        return None
    return target if found else None


@dataclass(slots=True)
class Salvage:
    """Takes rows over from one database into another; used by one thread."""

    source: Database
    target: Database
    taken: int = 0
    left: list[Row] = field(default_factory=list)
    """Entries that could not be taken over: they, or what they rest on, are damaged."""

    def take_all(self) -> None:
        """Every row that is whole."""
        self.take(sorted(_entries(self.source), key=lambda entry: entry["turn"]))

    def take(self, entries: Iterable[Row]) -> None:
        """Those that are whole and rest on nothing that is missing."""
        self.left = []
        kinds = set(self.target.table_names())
        self.target.execute("BEGIN IMMEDIATE")
        for entry in entries:
            if entry["kind"] in kinds and self._took(entry):
                self.taken += 1
            else:
                self.left.append(entry)
        self.target.execute("COMMIT")

    def _took(self, entry: Row) -> bool:
        row = _row(self.source, entry)
        if row is None:
            return False
        self._name_device(entry)
        if not self._has("operator", entry["who"]):
            entry = {**entry, "who": None}
        self.target.execute("SAVEPOINT one")
        try:
            insert(self.target, "entry", entry)
            insert(self.target, entry["kind"], row)
        except sqlite3.DatabaseError:
            self.target.execute("ROLLBACK TO one")
            return False
        finally:
            self.target.execute("RELEASE one")
        return True

    def _name_device(self, entry: Row) -> None:
        """A device whose own row is lost stands there without a name."""
        device = entry["device"]
        if entry["id"] == device or self._has("device", device):
            return
        self.target.execute("SAVEPOINT device")
        try:
            own = {**entry, "id": device, "kind": "device", "seq": 1, "turn": 0, "who": None}
            insert(self.target, "entry", own)
            insert(self.target, "device", {"id": device, "machine": "", "name": ""})
        except sqlite3.DatabaseError:
            self.target.execute("ROLLBACK TO device")
        finally:
            self.target.execute("RELEASE device")

    def _has(self, table: str, key: str | None) -> bool:
        sql = f"SELECT 1 FROM {table} WHERE id = ?"
        return self.target.execute(sql, [key]).fetchone() is not None


def _entries(source: Database) -> Iterator[Row]:
    """From both ends, up to where a page cannot be read."""
    seen = set()
    for order in ("ASC", "DESC"):
        with suppress(sqlite3.DatabaseError):
            for row in source.query(f"SELECT * FROM entry ORDER BY rowid {order}"):
                if row["id"] in seen:
                    break
                if _is_whole(row) and isinstance(row["turn"], int):
                    seen.add(row["id"])
                    yield row


def _row(source: Database, entry: Row) -> Row | None:
    """The row that an entry is about; None where it is damaged."""
    sql = f"SELECT * FROM {entry['kind']} WHERE id = ?"
    with suppress(sqlite3.DatabaseError):
        found = next(iter(source.query(sql, [entry["id"]])), None)
        return found if found is not None and _is_whole(found) else None
    return None


def _is_whole(row: Row) -> bool:
    return all(_REPLACED not in value for value in row.values() if isinstance(value, str))
