"""Rows made again from the facts beside the images, under the ids that they had."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from fieldcam.store.connection import rows
from fieldcam.store.facts import CaptureFacts
from fieldcam.store.queries.imports import has_cluster
from fieldcam.store.rows import Draft, EntryId, Row, new_id
from fieldcam.store.rows.orchard import Block, Cluster
from fieldcam.store.rows.walk import Capture, Event, EventKind, ObjectFile, ObjectRole, Visit
from fieldcam.store.store import Store

WHY = "it was made again from the facts beside its images"


def rebuild(store: Store, found: Iterable[CaptureFacts]) -> tuple[EntryId, ...]:
    """Captures of facts that had no row; both images must be there."""
    made = []
    for facts in found:
        if not _is_known(store, "capture", facts.id) and _has_images(store, facts.capture):
            store.together(_write, store, facts)
            made.append(facts.id)
    return tuple(made)


def _write(store: Store, facts: CaptureFacts) -> None:
    visit = None
    if facts.visit is not None and facts.block is not None:
        block = _block(store, facts.visit.block, facts.block)
        visit = _visit(store, facts.capture.visit, replace(facts.visit, block=block))
        _learn(store, block, facts)
    _name_calibration(store, facts.capture.calibration)
    known = facts.capture.retake_of
    retake_of = known if known is not None and _is_known(store, "capture", known) else None
    capture = replace(facts.capture, visit=visit, retake_of=retake_of)
    entries = [Draft(capture, facts.id, facts.shutter)]
    if facts.shutter is not None:
        event = Event(EventKind.SHUTTER, visit, facts.id, capture.tag_expected)
        entries.append(Draft(event, new_id(), facts.shutter))
    store.append(*entries, why=WHY)


def _block(store: Store, key: EntryId, block: Block) -> EntryId:
    return _kept(store, key, block, "name = ?", block.name)


def _visit(store: Store, key: EntryId | None, visit: Visit) -> EntryId:
    where = "block = ? AND day = ?"
    return _kept(store, key or new_id(), visit, where, visit.block, visit.day.isoformat())


def _kept(store: Store, key: EntryId, row: Row, where: str, *parameters: str) -> EntryId:
    """The row of this id, else the one that is alike, else a new one under this id."""
    if _is_known(store, row.table, key):
        return key
    sql = f"SELECT id FROM {row.table} JOIN standing USING (id) WHERE {where} LIMIT 1"
    alike = rows(store.database, sql, *parameters)
    if alike:
        return str(alike[0]["id"])
    return store.append(Draft(row, key), why=WHY)[0]


def _learn(store: Store, block: EntryId, facts: CaptureFacts) -> None:
    tag_id = facts.capture.tag_expected
    if tag_id is not None and not has_cluster(store.database, block, tag_id):
        tree = None if facts.tree is None else store.tree(block, facts.tree)
        store.append(Cluster(block, tag_id, tree), why=WHY)


def _name_calibration(store: Store, name: str | None) -> None:
    if name is None or rows(store.database, "SELECT 1 FROM object_file WHERE file = ?", name):
        return
    path = store.objects.path(name)
    if path.exists():
        store.append(ObjectFile(name, path.stat().st_size, ObjectRole.CALIBRATION), why=WHY)


def _is_known(store: Store, table: str, key: EntryId) -> bool:
    return bool(rows(store.database, f"SELECT 1 FROM {table} WHERE id = ?", key))


def _has_images(store: Store, capture: Capture) -> bool:
    return all(store.objects.path(n).exists() for n in (capture.left_file, capture.right_file))
