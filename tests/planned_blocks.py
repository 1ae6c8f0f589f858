"""Records of simulated blocks, as if somebody had measured them; and what is true of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta

import numpy as np

from fieldcam.growth.noise import NOISE
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting, SizeSource
from fieldcam.simulator.plan import BlockPlan, FruitletPlan
from fieldcam.values import Floats

FIRST_DAY = date(2026, 5, 10)
NOT_SEEN_BY_CAMERA = 0.1
USUAL_SD_MM, SD_SPREAD, WORST_SD_MM = 0.14, 0.5, 0.5
"""Standard deviations that a camera's readings state: log-normal, and no worse ones are given."""


@dataclass(frozen=True, slots=True)
class PlannedFruitlet:
    """One that hung there on the first of the days."""

    tag_id: int
    plan: FruitletPlan


@dataclass(frozen=True, slots=True)
class Measuring:
    """How a block is measured."""

    source: SizeSource
    days: tuple[int, ...]
    noisy: bool = True
    own_sds: bool = False
    """Each size states its own standard deviation, truly; else they scatter as was fitted."""


def day_date(day: int) -> date:
    return FIRST_DAY + timedelta(days=day)


def hanging(block: BlockPlan, day: int) -> list[PlannedFruitlet]:
    return [
        PlannedFruitlet(cluster.tag_id, fruitlet)
        for cluster in block.clusters
        for fruitlet in cluster.fruitlets
        if fruitlet.hangs(day)
    ]


def measured_block(block: BlockPlan, measuring: Measuring, seed: int) -> BlockRecord:
    """What a crew records of a planned block."""
    rng = np.random.default_rng([seed, 7])
    fruitlets = hanging(block, measuring.days[0])
    seen = np.stack([_seen(rng, fruitlets, measuring, day) for day in measuring.days])
    sds = np.stack([_sds(rng, len(fruitlets), measuring) for _ in measuring.days])
    sizes = np.stack(
        [
            _sizes(rng, fruitlets, measuring, day, of_day)
            for day, of_day in zip(measuring.days, sds, strict=True)
        ]
    )
    clusters = frozenset(cluster.tag_id for cluster in block.clusters)
    records = (
        FruitletRecord(
            each.tag_id,
            str(each.plan.id + 1),
            _sightings(each, measuring, seen[:, i], sizes[:, i], sds[:, i]),
        )
        for i, each in enumerate(fruitlets)
    )
    visits = tuple(day_date(day) for day in measuring.days)
    return BlockRecord(
        "planned",
        measuring.source,
        visits,
        dict.fromkeys(visits, clusters),
        tuple(record for record in records if record.sightings),
    )


def true_set_pct(block: BlockPlan, start: int, end: int) -> float:
    """The model on the noise-free sizes of every fruitlet."""
    fruitlets = hanging(block, start)
    rates = np.array(
        [(f.plan.diameter_mm(end) - f.plan.diameter_mm(start)) / (end - start) for f in fruitlets]
    )
    hangs = np.array([f.plan.hangs(end) for f in fruitlets])
    reference = np.sort(rates[hangs])[-20:].mean()
    return float(100.0 * (hangs & (rates > reference / 2)).mean())


def _seen(
    rng: np.random.Generator, fruitlets: Sequence[PlannedFruitlet], measuring: Measuring, day: int
) -> Floats:
    hidden = (
        NOT_SEEN_BY_CAMERA if measuring.source is SizeSource.CAMERA and measuring.noisy else 0.0
    )
    return np.asarray(rng.random(len(fruitlets)) >= hidden)


def _sds(rng: np.random.Generator, count: int, measuring: Measuring) -> Floats:
    """(N,) NaN where sizes state none."""
    if not measuring.own_sds:
        return np.full(count, np.nan)
    drawn = USUAL_SD_MM * np.exp(SD_SPREAD * rng.normal(size=count))
    return np.asarray(np.minimum(drawn, WORST_SD_MM))


def _sizes(
    rng: np.random.Generator,
    fruitlets: Sequence[PlannedFruitlet],
    measuring: Measuring,
    day: int,
    sds: Floats,
) -> Floats:
    true = np.array([each.plan.diameter_mm(day) for each in fruitlets])
    if not measuring.noisy:
        return true
    if measuring.own_sds:
        return np.asarray(rng.normal(true, sds))
    return true + NOISE[measuring.source].drawn(rng, true)


def _sightings(
    fruitlet: PlannedFruitlet, measuring: Measuring, seen: Floats, sizes: Floats, sds: Floats
) -> dict[date, Sighting]:
    found: dict[date, Sighting] = {}
    for day, visible, size, sd in zip(measuring.days, seen, sizes, sds, strict=True):
        if visible and fruitlet.plan.hangs(day):
            sd_mm = None if np.isnan(sd) else float(sd)
            found[day_date(day)] = Sighting(Presence.SIZED, float(size), sd_mm=sd_mm)
        elif found:
            presence = Presence.FALLEN if visible else Presence.NOT_SEEN
            found[day_date(day)] = Sighting(presence)
    return found
