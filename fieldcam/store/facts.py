"""What each capture's row says, in a file of its own beside the images.

With it the row can be made again where the database was lost: the visit, its day and
block, the tag and tree, the calibration and the time of the shutter. It is written before
the row, is named by its content as all files under `objects/`, and is never changed.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlite_utils import Database

from fieldcam.store.clock import Moment, utc_text
from fieldcam.store.connection import rows
from fieldcam.store.objects import FACTS_SUFFIX, Objects
from fieldcam.store.rows.orchard import Block
from fieldcam.store.rows.row import EntryId, columns, from_columns
from fieldcam.store.rows.walk import Capture, Visit

SCHEMA = 1


@dataclass(frozen=True, slots=True)
class CaptureFacts:
    """All that is known of a capture without the database."""

    id: EntryId
    capture: Capture
    shutter: Moment | None
    visit: Visit | None
    block: Block | None
    """Of the visit."""
    tree: str | None
    """The label of the tree in which the tag that was expected hangs, where that is known."""


def facts_of(
    database: Database, key: EntryId, capture: Capture, shutter: Moment | None
) -> CaptureFacts:
    """Of a capture whose row is about to be written."""
    found = rows(
        database,
        "SELECT visit.block, visit.day, block.name, block.orchard, block.variety, block.season,"
        " (SELECT tree.label FROM cluster_now AS cluster JOIN tree ON tree.id = cluster.tree"
        " WHERE cluster.block = visit.block AND cluster.tag_id = ?) AS tree"
        " FROM visit_now AS visit JOIN block_now AS block ON block.id = visit.block"
        " WHERE visit.id = ?",
        capture.tag_expected,
        capture.visit,
    )
    if not found:
        return CaptureFacts(key, capture, shutter, None, None, None)
    row = found[0]
    visit, block = from_columns(Visit, row), from_columns(Block, row)
    return CaptureFacts(key, capture, shutter, visit, block, row["tree"])


def dump_facts(facts: CaptureFacts) -> bytes:
    """As one JSON document."""
    document = {
        "schema": SCHEMA,
        "id": facts.id,
        "capture": columns(facts.capture),
        "shutter": None if facts.shutter is None else _moment(facts.shutter),
        "visit": None if facts.visit is None else columns(facts.visit),
        "block": None if facts.block is None else columns(facts.block),
        "tree": facts.tree,
    }
    return json.dumps(document, indent=1).encode() + b"\n"


def load_facts(content: bytes) -> CaptureFacts:
    """Raises ValueError where it is none, or of a newer form."""
    try:
        return _load(json.loads(content))
    except (KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("these are no facts of a capture") from error


def all_facts(objects: Objects) -> Iterator[CaptureFacts]:
    """Of all captures, in the order they were taken.

    Where two captures are of the same images, only the later one counts.
    """
    latest: dict[tuple[str, str], CaptureFacts] = {}
    for facts in sorted(
        _readable(objects), key=lambda each: datetime.fromisoformat(each.capture.taken_at)
    ):
        pair = facts.capture.left_file, facts.capture.right_file
        latest.pop(pair, None)
        latest[pair] = facts
    yield from latest.values()


def _readable(objects: Objects) -> Iterator[CaptureFacts]:
    for path in objects.names():
        if path.suffix == FACTS_SUFFIX and objects.is_intact(path.name):
            try:
                yield load_facts(path.read_bytes())
            except ValueError:
                continue


def _load(document: Mapping[str, Any]) -> CaptureFacts:
    if document["schema"] != SCHEMA:
        raise ValueError("these facts are of a form unknown here")
    visit, block = document["visit"], document["block"]
    return CaptureFacts(
        id=str(document["id"]),
        capture=from_columns(Capture, document["capture"]),
        shutter=None if document["shutter"] is None else _loaded(document["shutter"]),
        visit=None if visit is None else from_columns(Visit, visit),
        block=None if block is None else from_columns(Block, block),
        tree=document["tree"],
    )


def _moment(moment: Moment) -> dict[str, Any]:
    return {
        "utc": utc_text(moment.utc),
        "utc_offset_min": moment.utc_offset_min,
        "boot": moment.boot,
        "boot_ns": moment.boot_ns,
    }


def _loaded(d: Mapping[str, Any]) -> Moment:
    utc = datetime.fromisoformat(d["utc"])
    return Moment(utc, int(d["utc_offset_min"]), str(d["boot"]), int(d["boot_ns"]))
