"""How often the intervals of a forecast hold the truth, on simulated blocks.

`make coverage` prints the table of docs/growth.md. For each block the interval of its
tagged clusters has to hold the model's set on their noise-free sizes, and the interval of
all trees what blocks of the same variety have on average: the parabola through the
noise-free sets of all blocks over the share of persisting fruitlets, which is all in which
varieties differ for the model.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from planned_blocks import Measuring, day_date, measured_block, true_set_pct

from fieldcam.growth.forecast import forecast
from fieldcam.growth.records import SizeSource
from fieldcam.simulator.plan import BlockPlan, Variety
from fieldcam.values import Floats

FIRST_SEED = 9_000_000
SHAPES = ((70, 0, 4), (70, 4, 8), (70, 2, 6), (35, 0, 4), (35, 4, 8), (105, 0, 4), (105, 2, 6))
"""Clusters and the two days."""
BETWEEN = (2,)
"""Days of a visit between the first two days of SHAPES, which a camera's forecast uses too."""


@dataclass(frozen=True, slots=True)
class Case:
    """One kind of block and of measuring."""

    source: SizeSource
    clusters: int
    start: int
    end: int
    between: tuple[int, ...] = ()
    """Days of visits between the two."""
    own_sds: bool = False
    """Each size states its own standard deviation."""

    @property
    def days(self) -> tuple[int, ...]:
        return self.start, *self.between, self.end


@dataclass(frozen=True, slots=True)
class Trial:
    """One block: what is true, and what was forecast."""

    persist_share: float
    """Of its variety."""
    true_pct: float
    set_pct: float
    tagged_pct: tuple[float, float]
    trees_pct: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Coverage:
    """Of all trials of a case; all in percent or points."""

    tagged_pct: float
    trees_pct: float
    tagged_width: float
    trees_width: float
    bias: float
    mean_error: float
    """Absolute."""


def trial(case: Case, seed: int) -> Trial:
    variety = Variety.draw(np.random.default_rng([seed, 1]))
    block = BlockPlan.plan(seed, case.clusters, variety)
    measuring = Measuring(case.source, case.days, own_sds=case.own_sds)
    found = forecast(
        measured_block(block, measuring, seed), day_date(case.start), day_date(case.end)
    )
    of_trees = found.interval90_trees_pct
    assert of_trees is not None
    return Trial(
        variety.persist_share,
        true_set_pct(block, case.start, case.end),
        found.set_pct,
        found.interval90_pct,
        of_trees,
    )


def coverage(trials: Sequence[Trial]) -> Coverage:
    true = np.array([each.true_pct for each in trials])
    errors = np.array([each.set_pct for each in trials]) - true
    tagged = np.array([each.tagged_pct for each in trials])
    trees = np.array([each.trees_pct for each in trials])
    shares = np.array([each.persist_share for each in trials])
    expected = np.polyval(np.polyfit(shares, true, 2), shares)
    return Coverage(
        _held(tagged, true),
        _held(trees, expected),
        float(np.ptp(tagged, axis=1).mean()),
        float(np.ptp(trees, axis=1).mean()),
        float(errors.mean()),
        float(np.abs(errors).mean()),
    )


def _held(intervals: Floats, truth: Floats) -> float:
    # A set of so many fruitlets is a fraction, whose last digit depends on how it was reached.
    low, high = intervals[:, 0] - 1e-9, intervals[:, 1] + 1e-9
    return float(100.0 * ((low <= truth) & (truth <= high)).mean())


def rows(blocks: int, processes: int) -> Iterator[str]:
    yield "| measured with | clusters | days | tagged | width | all trees | width | bias | MAE |"
    yield "| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    seeds = range(FIRST_SEED, FIRST_SEED + blocks)
    with ProcessPoolExecutor(processes) as pool:
        for case in _cases():
            found = coverage(list(pool.map(partial(trial, case), seeds, chunksize=10)))
            yield _row(case, found)


def _cases() -> Iterator[Case]:
    for own_sds in (True, False):
        yield from (Case(SizeSource.CAMERA, *shape, own_sds=own_sds) for shape in SHAPES)
        yield Case(SizeSource.CAMERA, *SHAPES[0], BETWEEN, own_sds)
    yield from (Case(SizeSource.CALIPERS, *shape) for shape in SHAPES)


def _row(case: Case, found: Coverage) -> str:
    return (
        f"| {case.source}{' ±' if case.own_sds else ''} | {case.clusters}"
        f" | {' to '.join(map(str, case.days))}"
        f" | {found.tagged_pct:.1f}% | {found.tagged_width:.1f}"
        f" | {found.trees_pct:.1f}% | {found.trees_width:.1f}"
        f" | {found.bias:+.2f} | {found.mean_error:.2f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, default=1000)
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    for row in rows(arguments.blocks, arguments.processes):
        sys.stdout.write(f"{row}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
