"""Whether the database and the image files are what was written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum

from sqlite_utils import Database

from fieldcam.store.connection import damaged, database_path, rows
from fieldcam.store.objects import Objects
from fieldcam.store.rows.row import EntryId

NEWEST = 10
"""Captures whose files are hashed at every start: a crash can have hurt only the last ones."""
_FILES = (
    "SELECT capture.id, left_file AS name, left_bytes AS bytes, turn"
    " FROM capture JOIN entry USING (id)"
    " UNION ALL SELECT capture.id, right_file, right_bytes, turn"
    " FROM capture JOIN entry USING (id)"
    " UNION ALL SELECT object_file.id, file, bytes, turn FROM object_file JOIN entry USING (id)"
    " ORDER BY turn DESC"
)


class FileFault(StrEnum):
    """What is wrong with a file."""

    MISSING = "missing"
    CHANGED = "changed"
    """Its content is not what its name says."""


@dataclass(frozen=True, slots=True)
class FileProblem:
    """A file that is not what its row says."""

    entry: EntryId | None
    """The capture, or the row of a loose file; None: no row names the file."""
    name: str
    fault: FileFault
    belongs_to: str = "no picture"
    """In the operator's words, such as a picture's tag and day."""


def quick_check(database: Database) -> None:
    """Raise StorageDamaged when a page of the database is damaged."""
    _pragma_check(database, "quick_check(1)")


def full_check(database: Database) -> None:
    """As `quick_check`, with all indexes and references; slow on a large database."""
    _pragma_check(database, "integrity_check(1)")
    if rows(database, "PRAGMA foreign_key_check"):
        raise damaged(database_path(database))


def check_files(database: Database, objects: Objects) -> tuple[FileProblem, ...]:
    """Presence and size of every file, and the content of the newest."""
    files = rows(database, _FILES)
    newest = {file["id"] for file in files[: 2 * NEWEST]}
    return _named(database, _problems(objects, files, hashed=newest))


def rehash(database: Database, objects: Objects) -> tuple[FileProblem, ...]:
    """Reads every file; about 2 s for 1,000 pairs from a fast disk."""
    files = rows(database, _FILES)
    return _named(database, _problems(objects, files, hashed={file["id"] for file in files}))


def rehash_old(database: Database, objects: Objects) -> Iterator[FileProblem | None]:
    """Each file whose content `check_files` did not look at, one by one; None: it is good.

    The oldest comes last, so that what was damaged since the last season is found first.
    """
    for file in rows(database, _FILES)[2 * NEWEST :]:
        found = _named(database, _problems(objects, [file], hashed={file["id"]}))
        yield next(iter(found), None)


def _problems(
    objects: Objects, files: Iterable[dict[str, object]], hashed: set[object]
) -> Iterator[FileProblem]:
    for file in files:
        entry, name = str(file["id"]), str(file["name"])
        try:
            size = objects.path(name).stat().st_size
        except OSError:
            yield FileProblem(entry, name, FileFault.MISSING)
            continue
        if size != file["bytes"] or (entry in hashed and not objects.is_intact(name)):
            yield FileProblem(entry, name, FileFault.CHANGED)


def _named(database: Database, problems: Iterable[FileProblem]) -> tuple[FileProblem, ...]:
    """With what each file belongs to, which is looked up only where there is a problem."""
    found = tuple(problems)
    owners = _owners(database) if found else {}
    return tuple(replace(each, belongs_to=owners[each.entry]) for each in found)


def _owners(database: Database) -> dict[EntryId | None, str]:
    sql = "SELECT id, role FROM object_file"
    others = {row["id"]: f"a {row['role'].replace('_', ' ')}" for row in rows(database, sql)}
    sql = (
        "SELECT capture.id, capture.tag_id, coalesce(visit.day, capture.taken_at) AS day"
        " FROM capture_now AS capture LEFT JOIN visit_now AS visit ON visit.id = capture.visit"
    )
    return others | {row["id"]: _picture(row["tag_id"], row["day"]) for row in rows(database, sql)}


def _picture(tag_id: int | None, day: str) -> str:
    what = "a picture" if tag_id is None else f"tag {tag_id}"
    return f"{what} of {datetime.fromisoformat(day):%d %b %Y}"


def _pragma_check(database: Database, pragma: str) -> None:
    # Whether the pages are sound: what a row says is checked by its seal.
    database.execute("PRAGMA ignore_check_constraints=ON")
    try:
        answer = rows(database, f"PRAGMA {pragma}")
    finally:
        database.execute("PRAGMA ignore_check_constraints=OFF")
    if [list(row.values()) for row in answer] != [["ok"]]:
        raise damaged(database_path(database))
