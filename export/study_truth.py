"""What is true of a study set: its sizes without noise, and what calipers would have read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from export.study_captures import DAYS, StudySet
from export.study_data import day_of
from fieldcam.growth.noise import NOISE
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting, SizeSource
from fieldcam.simulator import ClusterPlan, FruitletPlan


@dataclass(frozen=True, slots=True)
class StudyTruth:
    """Two records of the same clusters."""

    exact: BlockRecord
    """Every fruitlet's size as it is; the model on it is the truth for a forecast."""
    calipers: BlockRecord
    """With the paper's caliper errors."""


def study_truth(of: StudySet, clusters: Sequence[ClusterPlan]) -> StudyTruth:
    """Of the clusters that were photographed; fruitlets are named by their identity."""
    rng = np.random.default_rng([of.seed, 9])
    days = [day_of(day) for day in DAYS]
    visited = dict.fromkeys(days, frozenset(c.tag_id for c in clusters))

    def record(fruitlets: Sequence[FruitletRecord]) -> BlockRecord:
        return BlockRecord(of.name, SizeSource.CALIPERS, tuple(days), visited, tuple(fruitlets))

    plans = [(c.tag_id, f) for c in clusters for f in c.fruitlets if f.hangs(DAYS[0])]
    exact = [FruitletRecord(tag, str(f.id), _sightings(f, None)) for tag, f in plans]
    read = [FruitletRecord(tag, str(f.id), _sightings(f, rng)) for tag, f in plans]
    return StudyTruth(record(exact), record(read))


def _sightings(fruitlet: FruitletPlan, rng: np.random.Generator | None) -> dict[date, Sighting]:
    found = {}
    for day in DAYS:
        size = np.array([fruitlet.diameter_mm(day)])
        if rng is not None:
            size = size + NOISE[SizeSource.CALIPERS].drawn(rng, size)
        hangs = fruitlet.hangs(day)
        found[day_of(day)] = (
            Sighting(Presence.SIZED, float(size[0])) if hangs else Sighting(Presence.FALLEN)
        )
    return found
