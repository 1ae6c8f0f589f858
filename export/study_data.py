"""What the growth study kept, as the values that association and evaluation take."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import date, timedelta
from typing import Any

from export.study_captures import DAYS, VIEWS, Job, StudySet
from fieldcam.exchange.readings import decode_reading
from fieldcam.growth.places import ClusterVisit, Place, View
from fieldcam.simulator import ClusterPlan

FIRST_DAY = date(2026, 5, 21)
Json = dict[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class StudyCluster:
    """One cluster on all days that were photographed so far, and the truth about it."""

    plan: ClusterPlan
    visits: tuple[ClusterVisit, ...]
    identities: Mapping[Place, int]
    """Which true fruitlet each fruitlet of a reading is; those of no target fruitlet lack."""
    visible: Mapping[str, Mapping[int, float]]
    """Visible fraction of each true fruitlet of the target, by reading."""


def day_of(day: int) -> date:
    return FIRST_DAY + timedelta(days=day)


def study_clusters(
    of: StudySet, stereo: str = "raft", views: int = VIEWS, clusters: int | None = None
) -> Iterator[StudyCluster]:
    """The clusters that were photographed on every day."""
    for index, plan in enumerate(of.block().clusters[:clusters]):
        if all(Job(of, index, day, 0).path.exists() for day in DAYS):
            yield _cluster(of, index, plan, stereo, views)


def _cluster(of: StudySet, index: int, plan: ClusterPlan, stereo: str, views: int) -> StudyCluster:
    identities: dict[Place, int] = {}
    visible: dict[str, dict[int, float]] = {}
    visits = []
    for day in DAYS:
        seen = []
        for job in (Job(of, index, day, view) for view in range(views)):
            if not job.path.exists():
                continue
            name = f"{index}/{day}/{job.view}"
            document = json.loads(gzip.decompress(job.path.read_bytes()))
            kept = document["readings"][stereo]
            seen.append(View(name, decode_reading(kept["reading"])))
            identities |= {Place(name, int(k)): v for k, v in kept["identities"].items()}
            visible[name] = {
                f["id"]: f["visible_fraction"] for f in document["truth"] if f["id"] >= 0
            }
        visits.append(ClusterVisit(day_of(day), tuple(seen)))
    return StudyCluster(plan, tuple(visits), identities, visible)
