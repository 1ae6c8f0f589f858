"""Everything needed to go on where a walk stopped, after a crash or a reboot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from sqlite_utils import Database

from fieldcam.store.captures import SavedCapture
from fieldcam.store.connection import database_path, rows
from fieldcam.store.objects import Objects
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.queries.walks import WalkRoute, walk_route
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.walk import EventKind

_LAST = 1 << 62
"""Larger than any turn."""
_UNDOABLE = (
    "decision",
    "skip",
    "fruitlet_mark",
    "tag_correction",
    "target_correction",
    "note",
    "caliper_size",
    "caliper_identity",
    "association_word",
)


@dataclass(frozen=True, slots=True)
class Resumption:
    """A visit that was not ended."""

    block: EntryId
    visit: EntryId
    day: date
    tag_id: int | None
    """Where the operator stands: at the last picture until it is decided on."""
    tree: EntryId | None
    """The tree that is walked; new clusters are learned into it."""
    undecided: tuple[EntryId, ...]
    """Captures that wait for the operator's decision, the oldest first."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A picture that was saved and has no reading."""

    saved: SavedCapture
    visit: EntryId | None
    tag_expected: int | None
    failures: int
    """How often its analysis failed."""


@dataclass(frozen=True, slots=True)
class Undoable:
    """The operator's newest row that still counts."""

    id: EntryId
    kind: str
    """The row's table."""


def resume(database: Database, visit: EntryId | None = None) -> Resumption | None:
    """The visit that was walked last and not ended, or the named one."""
    where = "visit.id = ?" if visit else f"? IS NULL AND NOT EXISTS ({_ENDED})"
    sql = (
        "SELECT visit.* FROM visit_now AS visit JOIN entry USING (id)"
        f" WHERE {where} ORDER BY ({_LAST_TURN}) DESC LIMIT 1"
    )
    found = rows(database, sql, visit)
    if not found:
        return None
    row = found[0]
    tag_id, tree = standing_at(database, walk_route(database, row["id"]))
    return Resumption(
        block=row["block"],
        visit=row["id"],
        day=date.fromisoformat(row["day"]),
        tag_id=tag_id,
        tree=tree,
        undecided=_undecided(database, row["id"]),
    )


_ENDED = (
    "SELECT 1 FROM event JOIN standing USING (id)"
    f" WHERE event.visit = visit.id AND event.event = '{EventKind.VISIT_ENDED}'"
)
_LAST_TURN = (
    "SELECT coalesce(max(other.turn), entry.turn) FROM entry AS other WHERE other.id IN ("
    "SELECT id FROM capture WHERE capture.visit = visit.id UNION ALL"
    f" SELECT id FROM event WHERE event.visit = visit.id AND event = '{EventKind.VISIT_OPENED}')"
)


_UNREAD = "FROM capture_now WHERE reading IS NULL AND action IS NOT 'discard'"


_FAILED = "EXISTS (SELECT 1 FROM analysis_failure WHERE capture = capture_now.id)"


def count_unread(database: Database, visit: EntryId) -> int:
    """How many pictures of a visit wait for their analysis; those on which it failed do not."""
    return _count(database, f"{_UNREAD} AND visit = ? AND NOT {_FAILED}", visit)


def count_failed(database: Database, visit: EntryId) -> int:
    """How many pictures of a visit could not be read and are not to be taken again."""
    wanted = "action IS NOT 'retake'"
    return _count(database, f"{_UNREAD} AND visit = ? AND {wanted} AND {_FAILED}", visit)


def _count(database: Database, which: str, visit: EntryId) -> int:
    return int(rows(database, f"SELECT count(*) AS pictures {which}", visit)[0]["pictures"])


def waiting_for_analysis(database: Database) -> tuple[Waiting, ...]:
    """Saved pictures without a reading, the oldest first; discarded ones apart."""
    failures = "(SELECT count(*) FROM analysis_failure WHERE capture = capture_now.id)"
    found = rows(database, f"SELECT *, {failures} AS failures {_UNREAD} ORDER BY turn")
    path = database_path(database)
    return tuple(
        Waiting(
            saved=_saved(path, row),
            visit=row["visit"],
            tag_expected=row["tag_expected"],
            failures=row["failures"],
        )
        for row in found
    )


def saved_capture(database: Database, capture: EntryId) -> SavedCapture | None:
    """A stored pair as the analysis takes it."""
    found = rows(database, "SELECT * FROM capture WHERE id = ?", capture)
    return _saved(database_path(database), found[0]) if found else None


def last_undoable(database: Database, device: EntryId, visit: EntryId) -> Undoable | None:
    """What the undo key takes back on the walk."""
    return next(iter(undoable_words(database, device, visit)), None)


def undoable_words(
    database: Database, device: EntryId, visit: EntryId, kinds: Sequence[str] = _UNDOABLE
) -> tuple[Undoable, ...]:
    """This device's standing words of these kinds since the visit began, the newest first."""
    places = ", ".join("?" * len(kinds))
    sql = (
        f"SELECT id, kind FROM standing WHERE device = ? AND kind IN ({places})"
        " AND turn > (SELECT turn FROM entry WHERE id = ?) ORDER BY turn DESC"
    )
    found = rows(database, sql, device, *kinds, visit)
    return tuple(Undoable(row["id"], row["kind"]) for row in found)


def capture_without_tag(database: Database, visit: EntryId) -> EntryId | None:
    """The visit's last picture, where nothing says yet which tag it shows.

    Going to another tag or tree leaves it behind.
    """
    sql = (
        "SELECT id, tag_id FROM capture_now WHERE visit = ? AND action IS NOT 'discard' AND turn >"
        " (SELECT coalesce(max(turn), 0) FROM event JOIN standing USING (id)"
        f" WHERE visit = ? AND event = '{EventKind.WENT_TO}') ORDER BY turn DESC LIMIT 1"
    )
    found = rows(database, sql, visit, visit)
    return found[0]["id"] if found and found[0]["tag_id"] is None else None


def tree_when_taken(database: Database, visit: EntryId, capture: EntryId) -> EntryId | None:
    """The tree that was walked when a picture was asked for."""
    fired = rows(
        database,
        f"SELECT tree FROM event WHERE capture = ? AND event = '{EventKind.SHUTTER}'"
        " AND tree IS NOT NULL",
        capture,
    )
    if fired:
        tree: EntryId = fired[0]["tree"]
        return tree
    turn = row_of(database, "entry", capture)["turn"]
    before = [*_went(database, visit, turn), *_taken(database, visit, turn)]
    last = max(before, key=lambda row: row["turn"], default=None)
    return None if last is None else _tree_at(walk_route(database, visit), last)


def standing_at(database: Database, route: WalkRoute) -> tuple[int | None, EntryId | None]:
    """The tag and the tree where the operator stands on this visit.

    That of the later of the last picture and the last turn to another tag or tree.
    """
    went, taken = _went(database, route.visit), _taken(database, route.visit)
    if went and (not taken or went[0]["turn"] > taken[0]["turn"]):
        tag_id = went[0]["tag_id"]
    elif taken and taken[0]["action"] in (None, "retake"):
        tag_id = taken[0]["tag_id"]
    else:
        tag_id = route.next_tag(taken[0]["tag_id"] if taken else None)
    stop = None if tag_id is None else route.stop(tag_id)
    if stop is not None and stop.tree is not None:
        return tag_id, stop.tree
    last = max([*went, *taken], key=lambda row: row["turn"], default=None)
    return tag_id, None if last is None else _tree_at(route, last)


def _went(database: Database, visit: EntryId, before: int = _LAST) -> list[dict[str, Any]]:
    """The last turn to another tag or tree."""
    sql = (
        "SELECT tag_id, tree, turn FROM event JOIN standing USING (id)"
        f" WHERE visit = ? AND event = '{EventKind.WENT_TO}' AND turn < ?"
        " ORDER BY turn DESC LIMIT 1"
    )
    return rows(database, sql, visit, before)


def _taken(database: Database, visit: EntryId, before: int = _LAST) -> list[dict[str, Any]]:
    """The last picture of a known tag."""
    sql = (
        "SELECT tag_id, action, turn FROM capture_now"
        " WHERE visit = ? AND tag_id IS NOT NULL AND turn < ? ORDER BY turn DESC LIMIT 1"
    )
    return rows(database, sql, visit, before)


def _tree_at(route: WalkRoute, place: dict[str, Any]) -> EntryId | None:
    """The tree that a turn names, else the one in which its tag, or that of a picture, hangs."""
    stop = None if place["tag_id"] is None else route.stop(place["tag_id"])
    return place.get("tree") or (None if stop is None else stop.tree)


def _undecided(database: Database, visit: EntryId) -> tuple[EntryId, ...]:
    sql = "SELECT id FROM capture_now WHERE visit = ? AND action IS NULL ORDER BY turn"
    return tuple(row["id"] for row in rows(database, sql, visit))


def _saved(path: Path, row: dict[str, Any]) -> SavedCapture:
    objects, calibration = Objects(path.parent), row["calibration"]
    return SavedCapture(
        row["id"],
        objects.path(row["left_file"]),
        objects.path(row["right_file"]),
        path,
        None if calibration is None else objects.path(calibration),
    )
