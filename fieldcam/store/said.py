"""What operators said about a cluster: each standing word with who and when."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date, datetime, timedelta, timezone
from typing import Any

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.queries.history import cluster_history
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.fruit import AssociationWord, CaliperIdentity, CaliperSize
from fieldcam.store.rows.judgements import (
    Action,
    Answer,
    Decision,
    FruitletMark,
    MarkKind,
    Note,
    Skip,
    TagCorrection,
    TargetCorrection,
)

Saying = (
    Decision
    | FruitletMark
    | TagCorrection
    | TargetCorrection
    | Note
    | Skip
    | CaliperSize
    | CaliperIdentity
    | AssociationWord
)


@dataclass(frozen=True, slots=True)
class Word:
    """One row about a cluster."""

    id: EntryId
    at: datetime
    """In the local time of where it was said."""
    who: str
    """Empty where nobody had signed in."""
    why: str
    capture: EntryId | None
    """The picture that it is about; None: the cluster on that visit."""
    saying: Saying


_PICTURES = "(SELECT value FROM json_each(here.captures))"
_READINGS = f"(SELECT id FROM reading WHERE capture IN {_PICTURES})"
_ON_CLUSTER = (
    "word.tag_id = here.tag_id"
    " AND word.visit IN (SELECT id FROM visit WHERE visit.block = here.block)"
)
_SHOWN_IN = "(SELECT capture FROM reading WHERE reading.id = word.reading)"
_ABOUT = {
    "decision": ("word.capture", f"word.capture IN {_PICTURES}"),
    "tag_correction": ("word.capture", f"word.capture IN {_PICTURES}"),
    "target_correction": (_SHOWN_IN, f"word.reading IN {_READINGS}"),
    "fruitlet_mark": (_SHOWN_IN, f"word.reading IN {_READINGS} OR ({_ON_CLUSTER})"),
    "note": ("word.subject", f"word.subject IN {_PICTURES}"),
    "skip": ("NULL", _ON_CLUSTER),
    "caliper_size": ("NULL", "word.block = here.block AND word.tag_id = here.tag_id"),
    "caliper_identity": (_SHOWN_IN, f"word.reading IN {_READINGS}"),
    "association_word": (
        "(SELECT capture FROM reading WHERE reading.id = word.one_reading)",
        f"word.one_reading IN {_READINGS}",
    ),
}
"""For each table, the picture that a row is about, and whether it is about the cluster."""


def said(database: Database, block: EntryId, tag_id: int) -> tuple[Word, ...]:
    """All that stands, the oldest first."""
    captures = [record.id for record in cluster_history(database, block, tag_id)]
    found = []
    for table, (about, condition) in _ABOUT.items():
        sql = (
            "WITH here (captures, block, tag_id) AS (VALUES (?, ?, ?))"
            f" SELECT word.*, {about} AS about, standing.turn, standing.at_utc,"
            " standing.utc_offset_min, standing.why, operator.name AS operator"
            f" FROM here JOIN {table} AS word JOIN standing ON standing.id = word.id"
            f" LEFT JOIN operator ON operator.id = standing.who WHERE {condition}"
        )
        for row in rows(database, sql, json.dumps(captures), block, tag_id):
            found.append((row["turn"], _word(row, _SAYINGS[table])))
    return tuple(word for _, word in sorted(found, key=lambda pair: pair[0]))


def _word(row: dict[str, Any], saying: Callable[[dict[str, Any]], Saying]) -> Word:
    at = datetime.fromisoformat(row["at_utc"])
    return Word(
        id=row["id"],
        at=at.astimezone(timezone(timedelta(minutes=row["utc_offset_min"]))),
        who=row["operator"] or "",
        why=row["why"] or "",
        capture=row["about"],
        saying=saying(row),
    )


def _decision(row: dict[str, Any]) -> Decision:
    answer = None if row["answer"] is None else Answer(row["answer"])
    return Decision(row["capture"], Action(row["action"]), answer)


def _mark(row: dict[str, Any]) -> FruitletMark:
    return FruitletMark(
        MarkKind(row["mark"]),
        row["reading"],
        row["fruitlet"],
        row["visit"],
        row["tag_id"],
        row["count"],
        row["x_px"],
        row["y_px"],
        row["diameter_mm"],
    )


def _caliper_size(row: dict[str, Any]) -> CaliperSize:
    return CaliperSize(
        row["block"],
        row["tag_id"],
        date.fromisoformat(row["day"]),
        row["fruit"],
        row["diameter_mm"],
        row["source"],
    )


_SAYINGS: dict[str, Callable[[dict[str, Any]], Saying]] = {
    "decision": _decision,
    "tag_correction": lambda row: TagCorrection(row["capture"], row["tag_id"]),
    "target_correction": lambda row: TargetCorrection(row["reading"], row["cluster"]),
    "fruitlet_mark": _mark,
    "note": lambda row: Note(row["text"], row["subject"]),
    "skip": lambda row: Skip(row["visit"], row["tag_id"]),
    "caliper_size": _caliper_size,
    "caliper_identity": lambda row: CaliperIdentity(row["reading"], row["fruitlet"], row["fruit"]),
    "association_word": lambda row: AssociationWord(
        row["one_reading"], row["one_fruitlet"], row["other_reading"], row["other_fruitlet"]
    ),
}
