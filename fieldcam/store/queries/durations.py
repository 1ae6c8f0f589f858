"""Seconds per cluster, from the times of shutters and decisions."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from statistics import median
from typing import Any

from sqlite_utils import Database

from fieldcam.store.clock import Moment, seconds_between
from fieldcam.store.connection import rows
from fieldcam.store.rows.row import EntryId

LONGEST_S = 300.0
"""Between two acceptances; more is a pause, or the app was closed."""


@dataclass(frozen=True, slots=True)
class ClusterTime:
    """How long one accepted cluster took."""

    tag_id: int
    at_cluster_s: float | None
    """From the cluster's first shutter to its acceptance; None where clocks contradict."""
    since_last_s: float | None
    """From the acceptance before, walking included; None for the first."""


@dataclass(frozen=True, slots=True)
class VisitTimes:
    """The clusters of a visit in the order in which they were accepted."""

    clusters: tuple[ClusterTime, ...]
    duration_s: float | None = None
    """From the first shutter to the last acceptance, less the pauses in between."""

    @property
    def median_s(self) -> float | None:
        """Seconds per cluster, walking included and pauses left out."""
        times = (c.since_last_s for c in self.clusters)
        known = [time_s for time_s in times if time_s is not None and not is_pause(time_s)]
        return median(known) if known else None


def visit_times(database: Database, visit: EntryId) -> VisitTimes:
    """Seconds per cluster of a visit so far."""
    accepted = _accepted(database, visit)
    first_shutter = _first_shutters(database, visit)
    clusters = []
    before: Moment | None = None
    for tag_id, moment in accepted.items():
        shutter = first_shutter.get(tag_id)
        at_cluster = None if shutter is None else seconds_between(shutter, moment)
        since = None if before is None else seconds_between(before, moment)
        clusters.append(ClusterTime(tag_id, at_cluster, since))
        before = moment
    first = next(iter(first_shutter.values()), None)
    duration = None if first is None or before is None else seconds_between(first, before)
    if duration is not None:
        times = (cluster.since_last_s or 0.0 for cluster in clusters)
        duration -= sum(time_s for time_s in times if is_pause(time_s))
    return VisitTimes(tuple(clusters), duration)


def is_pause(time_s: float) -> bool:
    """Whether it is too long to be work at one cluster."""
    return time_s > LONGEST_S


def _accepted(database: Database, visit: EntryId) -> dict[int, Moment]:
    """When each cluster was accepted first, in that order."""
    found = rows(
        database,
        "SELECT capture.tag_id, entry.* FROM capture_now AS capture"
        " JOIN entry ON entry.id = capture.decision"
        " WHERE capture.visit = ? AND capture.action = 'accept' AND capture.tag_id IS NOT NULL"
        " ORDER BY entry.turn",
        visit,
    )
    return _first_of_each_tag(found)


def _first_shutters(database: Database, visit: EntryId) -> dict[int, Moment]:
    """The shutter's own time where it was kept, else the time of saving."""
    found = rows(
        database,
        "SELECT capture.tag_id, entry.* FROM capture_now AS capture"
        " LEFT JOIN event ON event.capture = capture.id AND event.event = 'shutter'"
        " JOIN entry ON entry.id = coalesce(event.id, capture.id)"
        " WHERE capture.visit = ? AND capture.tag_id IS NOT NULL ORDER BY entry.turn",
        visit,
    )
    return _first_of_each_tag(found)


def _first_of_each_tag(found: list[dict[str, Any]]) -> dict[int, Moment]:
    first: dict[int, Moment] = {}
    for row in found:
        first.setdefault(row["tag_id"], _moment(row))
    return first


def _moment(row: dict[str, Any]) -> Moment:
    at = datetime.fromisoformat(row["at_utc"])
    return Moment(at, row["utc_offset_min"], row["boot"], row["boot_ns"])
