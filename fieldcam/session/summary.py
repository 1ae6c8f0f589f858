"""What a walk came to, for its end."""

from __future__ import annotations

from dataclasses import dataclass

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.queries.blocks import visits
from fieldcam.store.queries.history import CaptureRecord, visit_captures
from fieldcam.store.queries.walks import WalkRoute
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.judgements import Action, MarkKind
from fieldcam.values import Status


@dataclass(frozen=True, slots=True)
class WalkSummary:
    """Of one visit."""

    taken: int
    """Clusters."""
    retaken: int
    """Pictures."""
    skipped: int
    """Clusters."""
    fallen: int
    """Fruitlets that no picture shows, as the operator said."""
    hidden: int
    doubtful: tuple[int, ...]
    """Tags of pictures that were accepted against the verdict, or without one."""
    visited_before: bool
    """There is an earlier day to compare with."""


def walk_summary(database: Database, route: WalkRoute) -> WalkSummary:
    """Of the route's visit."""
    marks = _marks(database, route.visit)
    captures = visit_captures(database, route.visit)
    accepted = [record for record in captures if record.action is Action.ACCEPT]
    others = (v for v in visits(database, route.block) if v.id != route.visit and v.accepted)
    return WalkSummary(
        taken=route.taken,
        retaken=sum(record.action is Action.RETAKE for record in captures),
        skipped=route.skipped,
        fallen=marks.get(MarkKind.FALLEN, 0),
        hidden=marks.get(MarkKind.HIDDEN, 0),
        doubtful=tuple(
            dict.fromkeys(
                record.tag_id
                for record in accepted
                if record.tag_id is not None and _is_doubtful(record)
            )
        ),
        visited_before=any(others),
    )


def _is_doubtful(record: CaptureRecord) -> bool:
    return record.reading is None or record.reading.status is Status.RETAKE


def _marks(database: Database, visit: EntryId) -> dict[MarkKind, int]:
    """Fruitlets that no picture of a visit shows, by what was said of them."""
    sql = (
        "SELECT mark, sum(count) AS fruitlets FROM fruitlet_mark_now WHERE visit = ? GROUP BY mark"
    )
    return {MarkKind(row["mark"]): row["fruitlets"] for row in rows(database, sql, visit)}
