"""The whole evaluation of a block against calipers: the paper's Tables 2 and 4, and speed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from statistics import mean, median

from fieldcam.growth.evaluation.following import (
    NO_FATES,
    NO_MATCHES,
    AssociationScore,
    FateScore,
    score_association,
    score_fates,
)
from fieldcam.growth.evaluation.named import NamedCluster, fruit_of, known_records
from fieldcam.growth.evaluation.sizing import SizePair, SizingScore, pair_sizes, score_sizes
from fieldcam.growth.from_tracks import TrackedCluster, camera_record, tracked_cluster
from fieldcam.growth.places import Association
from fieldcam.growth.records import BlockRecord, FruitletRecord
from fieldcam.growth.tracking import track

CALIPERS_S = 30.0
"""By calipers, for each cluster, as growers say (paper, "Fruitlet Sizing")."""
PersistPct = Callable[[BlockRecord], float | None]
"""A forecast: persisting fruitlets in percent; None where there is none."""


@dataclass(frozen=True, slots=True)
class FollowingScore:
    """One way of association, from pictures to the forecast."""

    method: Association
    association: AssociationScore
    fates: FateScore
    persist_pct: float | None


@dataclass(frozen=True, slots=True)
class ReadingsScore:
    """All that was made of one set of readings."""

    name: str
    """Such as its stereo matcher."""
    pairs: tuple[SizePair, ...]
    by_day: Mapping[date, SizingScore]
    all_days: SizingScore
    unnamed: int
    """Fruitlets of target clusters that have no name in their picture."""
    known_persist_pct: float | None
    """The forecast with known association."""
    following: tuple[FollowingScore, ...]


@dataclass(frozen=True, slots=True)
class Seconds:
    """Time for one cluster."""

    n: int
    mean_s: float
    median_s: float

    @property
    def times_faster(self) -> float | None:
        """Than calipers."""
        return CALIPERS_S / self.median_s if self.median_s else None


@dataclass(frozen=True, slots=True)
class Evaluation:
    """A block by camera and by calipers."""

    block: str
    persist_pct: float | None
    """Of the calipers: what the forecasts by camera are compared with."""
    readings: tuple[ReadingsScore, ...]
    seconds: Mapping[str, Seconds] = field(default_factory=dict)
    """By what was timed."""
    simulated: bool = False
    notes: tuple[str, ...] = ()
    """What was assumed, and why there is no forecast where there is none."""


def score_readings(
    name: str,
    clusters: Iterable[NamedCluster],
    calipers: BlockRecord,
    persist_pct: PersistPct,
    methods: Sequence[Association] = tuple(Association),
) -> ReadingsScore:
    """Each cluster is looked at once and let go, since readings take room."""
    known: list[FruitletRecord] = []
    photographed: list[TrackedCluster] = []
    runs = [_Run(method) for method in methods]
    unnamed = 0
    for cluster in clusters:
        fruit = fruit_of(calipers, cluster.tag_id)
        known += known_records(cluster, fruit)
        photographed.append(tracked_cluster(cluster.tag_id, cluster.visits, ()))
        unnamed += cluster.unnamed
        for run in runs:
            run.add(cluster, fruit)
    pairs = pair_sizes(known, calipers.fruitlets)
    block = replace(camera_record(calipers.name, photographed), fruitlets=tuple(known))
    return ReadingsScore(
        name,
        pairs,
        {day: score_sizes([p for p in pairs if p.day == day]) for day in _days(pairs)},
        score_sizes(pairs),
        unnamed,
        persist_pct(block),
        tuple(run.score(calipers.name, persist_pct) for run in runs),
    )


def aapd(persist_pct: float | None, truth_pct: float | None) -> float | None:
    """Absolute difference of two abscission rates, percentage points."""
    if persist_pct is None or truth_pct is None:
        return None
    return abs(persist_pct - truth_pct)


def seconds_of(times_s: Sequence[float]) -> Seconds | None:
    """None where nothing was timed."""
    return Seconds(len(times_s), mean(times_s), median(times_s)) if times_s else None


@dataclass(slots=True)
class _Run:
    """What one way of association has come to so far."""

    method: Association
    clusters: list[TrackedCluster] = field(default_factory=list)
    association: AssociationScore = NO_MATCHES
    fates: FateScore = NO_FATES

    def add(self, cluster: NamedCluster, truth: Mapping[str, FruitletRecord]) -> None:
        tracks = track(cluster.visits, self.method, cluster.words)
        self.clusters.append(tracked_cluster(cluster.tag_id, cluster.visits, tracks))
        self.association += score_association(cluster, tracks)
        self.fates += score_fates(cluster, tracks, truth)

    def score(self, block: str, persist_pct: PersistPct) -> FollowingScore:
        followed = camera_record(block, self.clusters)
        return FollowingScore(self.method, self.association, self.fates, persist_pct(followed))


def _days(pairs: Iterable[SizePair]) -> list[date]:
    return sorted({pair.day for pair in pairs})
