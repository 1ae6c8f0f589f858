"""What the growth study kept, as the values that association and evaluation take."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import date, timedelta
from typing import Any

from export.study_captures import DAYS, VIEWS, Job, StudySet
from export.study_sights import sights
from fieldcam.codec.readings import load_reading
from fieldcam.growth.evaluation.named import NamedCluster
from fieldcam.growth.places import ClusterVisit, Place, View
from fieldcam.report.scoring import WELL_VISIBLE
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
    """Visible fraction of each true fruitlet of the target, by reading; of one that has
    fallen, what it would be if it still hung there."""

    @property
    def named(self) -> NamedCluster:
        """By the true identities."""
        names = {place: str(id_) for place, id_ in self.identities.items()}
        return NamedCluster(
            self.plan.tag_id, self.visits, names, out_of_sight=frozenset(self._out_of_sight())
        )

    def _out_of_sight(self) -> Iterator[tuple[str, date]]:
        for day, visit in zip(DAYS, self.visits, strict=True):
            for fruitlet in (f for f in self.plan.fruitlets if not f.hangs(day)):
                seen = max(self.visible[view.id].get(fruitlet.id, 0.0) for view in visit.views)
                if seen < WELL_VISIBLE:
                    yield str(fruitlet.id), visit.day


def day_of(day: int) -> date:
    return FIRST_DAY + timedelta(days=day)


def study_clusters(
    of: StudySet, stereo: str = "raft", views: int = VIEWS, clusters: int | None = None
) -> Iterator[StudyCluster]:
    """The clusters that were photographed on every day."""
    for index, plan in enumerate(of.block().clusters[:clusters]):
        if all(Job(of, index, day, 0).path.exists() for day in DAYS):
            yield _cluster(of, index, plan, stereo, views)


def with_counts(cluster: StudyCluster) -> StudyCluster:
    """The same cluster where the operator said at each tag how many are missing, and why."""
    return replace(cluster, visits=tuple(_counted(cluster, k) for k in range(len(DAYS))))


def _counted(cluster: StudyCluster, visit: int) -> ClusterVisit:
    """Of the fruitlets that an earlier picture showed."""
    known = set().union(*(_shown(cluster, k) for k in range(visit)))
    missing = known - _shown(cluster, visit)
    hangs = {f.id: [f.hangs(day) for day in DAYS] for f in cluster.plan.fruitlets}
    fell = sum(hangs[k][visit - 1] and not hangs[k][visit] for k in missing)
    hidden = sum(hangs[k][visit] for k in missing)
    return replace(cluster.visits[visit], fallen=fell, hidden=hidden)


def _shown(cluster: StudyCluster, visit: int) -> set[int]:
    pictures = {view.id for view in cluster.visits[visit].views}
    return {k for place, k in cluster.identities.items() if place.reading in pictures}


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
            seen.append(View(name, load_reading(json.dumps(kept["reading"]))))
            identities |= {Place(name, int(k)): v for k, v in kept["identities"].items()}
            visible[name] = {
                f["id"]: f["visible_fraction"] for f in document["truth"] if f["id"] >= 0
            } | dict(sights(job))
        visits.append(ClusterVisit(day_of(day), tuple(seen)))
    return StudyCluster(plan, tuple(visits), identities, visible)
