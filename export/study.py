"""The paper's tables on the rendered sets that `export.study_captures` photographed.

`python -m export.study [--clusters N] [--views N] [--report HTML]` evaluates what is there
and prints the tables of docs/growth.md; calipers are the truth with the paper's errors.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean

from export.study_captures import CLUSTERS, DAYS, STUDY, VIEWS, StudySet
from export.study_data import StudyCluster, day_of, study_clusters, with_counts
from export.study_truth import StudyTruth, study_truth
from fieldcam.errors import BadInput
from fieldcam.growth.evaluation.evaluating import (
    Evaluation,
    FollowingScore,
    ReadingsScore,
    aapd,
    score_readings,
)
from fieldcam.growth.forecast import forecast
from fieldcam.growth.places import Association
from fieldcam.growth.records import BlockRecord
from fieldcam.report.evaluation_page import evaluation_page

ONLY_GEOMETRY = (Association.GEOMETRY,)


@dataclass(frozen=True, slots=True)
class SetResult:
    """One set, evaluated."""

    clusters: int
    pictures: int
    evaluation: Evaluation
    true_persist_pct: float
    """Of the model on the exact sizes."""


def persist_pct(block: BlockRecord) -> float | None:
    """From the first visit to the last."""
    try:
        return forecast(block, day_of(DAYS[0]), day_of(DAYS[-1])).set_pct
    except BadInput:
        return None


def evaluate(of: StudySet, clusters: int, views: int) -> SetResult:
    """By both matchers."""
    found = list(study_clusters(of, "raft", views, clusters))
    truth = study_truth(of, [c.plan for c in found])
    true_pct = persist_pct(truth.exact)
    assert true_pct is not None  # every planned block grows
    readings = (
        _scored("RAFT", found, truth, tuple(Association)),
        _scored("RAFT and operator", map(with_counts, found), truth, ONLY_GEOMETRY),
        _scored("SGBM", study_clusters(of, "sgbm", views, clusters), truth, ONLY_GEOMETRY),
    )
    evaluation = Evaluation(of.name, persist_pct(truth.calipers), readings, simulated=True)
    pictures = sum(len(v.views) for c in found for v in c.visits)
    return SetResult(len(found), pictures, evaluation, true_pct)


def _scored(
    name: str,
    clusters: Iterable[StudyCluster],
    truth: StudyTruth,
    methods: Sequence[Association],
) -> ReadingsScore:
    named = (cluster.named for cluster in clusters)
    return score_readings(name, named, truth.calipers, persist_pct, methods)


def sizing_table(results: Sequence[SetResult]) -> Iterator[str]:
    """The paper's Table 2."""
    yield "| set | day | MAE mm | MAPE % | % sized | R2 | bias mm | limits of agreement mm |"
    yield "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    for result in results:
        for readings in result.evaluation.readings:
            scores = [(f"{d:%d}", s) for d, s in readings.by_day.items()]
            days = [(str(DAYS[k] + 1), s) for k, (_, s) in enumerate(scores)]
            for day, score in [*days, ("all", readings.all_days)]:
                agreed = score.agreement
                limits = None if agreed is None else agreed.limits_mm
                yield (
                    f"| {result.evaluation.block}, {readings.name} | {day}"
                    f" | {_number(score.mae_mm, '.3f')} | {_number(score.mape_pct, '.2f')}"
                    f" | {_number(score.sized_pct, '.1f')} | {_number(score.r2, '.3f')}"
                    f" | {'-' if agreed is None else f'{agreed.bias_mm:+.3f}'}"
                    f" | {'-' if limits is None else f'{limits[0]:+.2f} to {limits[1]:+.2f}'} |"
                )


def forecast_table(results: Sequence[SetResult]) -> Iterator[str]:
    """The paper's Table 4; against calipers, as there, and against the truth."""
    names = [r.evaluation.block for r in results]
    yield "| | " + " | ".join([*names, "mean"]) + " |"
    yield "| --- | " + " | ".join(["---:"] * (len(names) + 1)) + " |"
    yield _row("clusters, pictures", [f"{r.clusters}, {r.pictures}" for r in results])
    yield _row("persist %, exact sizes", [f"{r.true_persist_pct:.1f}" for r in results])
    yield _row("persist %, calipers", [_number(r.evaluation.persist_pct, ".1f") for r in results])
    for k, readings in enumerate(results[0].evaluation.readings):
        yield from _known_rows(results, k, readings.name)
        for n, run in enumerate(readings.following):
            yield from _followed_rows(results, k, n, f"{readings.name}, {run.method}")


def _known_rows(results: Sequence[SetResult], k: int, name: str) -> Iterator[str]:
    known = [r.evaluation.readings[k].known_persist_pct for r in results]
    yield _row(f"{name}: KA persist %", [_number(x, ".1f") for x in known])
    yield _differences(f"{name}: KA AAPD", results, known)


def _followed_rows(results: Sequence[SetResult], k: int, n: int, name: str) -> Iterator[str]:
    runs: list[FollowingScore] = [r.evaluation.readings[k].following[n] for r in results]
    yield _measure(f"{name}: precision %", [run.association.precision_pct for run in runs])
    yield _measure(f"{name}: recall %", [run.association.recall_pct for run in runs])
    if any(run.fates.right_pct is not None for run in runs):
        yield _measure(f"{name}: fallen or not seen right %", [r.fates.right_pct for r in runs])
    found = [run.persist_pct for run in runs]
    yield _row(f"{name}: E2E persist %", [_number(x, ".1f") for x in found])
    yield _differences(f"{name}: E2E AAPD", results, found)
    exact = [aapd(x, r.true_persist_pct) for x, r in zip(found, results, strict=True)]
    yield _measure(f"{name}: E2E off the truth", exact)


def _differences(name: str, results: Sequence[SetResult], found: Sequence[float | None]) -> str:
    against = [r.evaluation.persist_pct for r in results]
    return _measure(name, [aapd(x, y) for x, y in zip(found, against, strict=True)])


def _measure(name: str, values: Sequence[float | None]) -> str:
    known = [v for v in values if v is not None]
    last = f"{mean(known):.1f}" if known else "-"
    return _row(name, [_number(v, ".1f") for v in values], last)


def _row(name: str, cells: Sequence[str], last: str = "") -> str:
    return f"| {name} | " + " | ".join([*cells, last]) + " |"


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clusters", type=int, default=CLUSTERS)
    parser.add_argument("--views", type=int, default=VIEWS)
    parser.add_argument("--report", type=Path)
    arguments = parser.parse_args()
    results = [evaluate(of, arguments.clusters, arguments.views) for of in STUDY]
    print("\n".join([*forecast_table(results), "", *sizing_table(results)]))
    if arguments.report is not None:
        arguments.report.write_text(evaluation_page([r.evaluation for r in results]))


if __name__ == "__main__":
    main()
