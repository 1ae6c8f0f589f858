"""What operators said about a cluster: each standing word with who and when."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from typing import Any

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.queries.history import cluster_history
from fieldcam.store.rows.kinds import WORDS
from fieldcam.store.rows.row import EntryId, Row, from_columns


@dataclass(frozen=True, slots=True)
class StandingWord:
    """One row about a cluster."""

    id: EntryId
    at: datetime
    """In the local time of where it was said."""
    who: str
    """Empty where nobody had signed in."""
    why: str
    capture: EntryId | None
    """The picture that it is about; None: the cluster on that visit."""
    saying: Row


def said(database: Database, block: EntryId, tag_id: int) -> tuple[StandingWord, ...]:
    """All that stands, the oldest first."""
    captures = [record.id for record in cluster_history(database, block, tag_id)]
    found = []
    for kind, subject in WORDS.items():
        sql = (
            "WITH here (captures, block, tag_id) AS (VALUES (?, ?, ?))"
            f" SELECT word.*, {subject.picture} AS about, standing.turn, standing.at_utc,"
            " standing.utc_offset_min, standing.why, operator.name AS operator"
            f" FROM here JOIN {kind.table} AS word JOIN standing ON standing.id = word.id"
            f" LEFT JOIN operator ON operator.id = standing.who WHERE {subject.here}"
        )
        for row in rows(database, sql, json.dumps(captures), block, tag_id):
            found.append((row["turn"], _word(row, from_columns(kind, row))))
    return tuple(word for _, word in sorted(found, key=lambda pair: pair[0]))


def _word(row: dict[str, Any], saying: Row) -> StandingWord:
    at = datetime.fromisoformat(row["at_utc"])
    return StandingWord(
        id=row["id"],
        at=at.astimezone(timezone(timedelta(minutes=row["utc_offset_min"]))),
        who=row["operator"] or "",
        why=row["why"] or "",
        capture=row["about"],
        saying=saying,
    )
