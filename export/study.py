"""The paper's tables on the rendered sets that `export.study_captures` photographed.

`python -m export.study [--clusters N] [--views N] [--report HTML]` evaluates what is there
and prints the tables of docs/growth.md; calipers are the truth with the paper's errors.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat
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
from fieldcam.growth.evaluation.following import NO_FATES
from fieldcam.growth.forecast import forecast
from fieldcam.growth.places import Association
from fieldcam.growth.records import BlockRecord
from fieldcam.report.evaluation_page import evaluation_page

ONLY_GEOMETRY = (Association.GEOMETRY,)
OPERATOR = "RAFT and operator"
"""The same readings, and at each tag the operator's count of what fell and what is hidden."""


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
        _scored(OPERATOR, map(with_counts, found), truth, ONLY_GEOMETRY),
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
        for readings in (r for r in result.evaluation.readings if r.name != OPERATOR):
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
        if readings.name != OPERATOR:
            yield from _known_rows(results, k, readings.name)
        for n, run in enumerate(readings.following):
            name = f"{readings.name}, {run.method}"
            if readings.name != OPERATOR:
                yield from _association_rows(results, k, n, name)
            if run.method is Association.GEOMETRY:
                yield from _fate_rows(results, k, n, name)
            yield from _end_to_end_rows(results, k, n, name)


def _known_rows(results: Sequence[SetResult], k: int, name: str) -> Iterator[str]:
    known = [r.evaluation.readings[k].known_persist_pct for r in results]
    yield _row(f"{name}: KA persist %", [_number(x, ".1f") for x in known])
    yield _differences(f"{name}: KA AAPD", results, known)


def _association_rows(results: Sequence[SetResult], k: int, n: int, name: str) -> Iterator[str]:
    scores = [run.association for run in _runs(results, k, n)]
    yield _measure(f"{name}: precision %", [score.precision_pct for score in scores])
    yield _measure(f"{name}: recall %", [score.recall_pct for score in scores])


def _fate_rows(results: Sequence[SetResult], k: int, n: int, name: str) -> Iterator[str]:
    scores = [run.fates for run in _runs(results, k, n)]
    whole = sum(scores, NO_FATES)
    cells = [_number(score.right_pct, ".1f") for score in scores]
    yield _row(f"{name}: fallen or not seen right %", cells, _number(whole.right_pct, ".1f"))
    yield _row(f"{name}: of cases", [str(score.cases) for score in scores], str(whole.cases))
    wrongly = [score.fallen_but_hangs for score in scores]
    yield _row(f"{name}: hidden, called fallen", map(str, wrongly), str(sum(wrongly)))


def _end_to_end_rows(results: Sequence[SetResult], k: int, n: int, name: str) -> Iterator[str]:
    found = [run.persist_pct for run in _runs(results, k, n)]
    yield _row(f"{name}: E2E persist %", [_number(x, ".1f") for x in found])
    yield _differences(f"{name}: E2E AAPD", results, found)
    exact = [aapd(x, r.true_persist_pct) for x, r in zip(found, results, strict=True)]
    yield _measure(f"{name}: E2E off the truth", exact)


def _runs(results: Sequence[SetResult], k: int, n: int) -> list[FollowingScore]:
    return [result.evaluation.readings[k].following[n] for result in results]


def _differences(name: str, results: Sequence[SetResult], found: Sequence[float | None]) -> str:
    against = [r.evaluation.persist_pct for r in results]
    return _measure(name, [aapd(x, y) for x, y in zip(found, against, strict=True)])


def _measure(name: str, values: Sequence[float | None]) -> str:
    known = [v for v in values if v is not None]
    last = f"{mean(known):.1f}" if known else "-"
    return _row(name, [_number(v, ".1f") for v in values], last)


def _row(name: str, cells: Iterable[str], last: str = "") -> str:
    return f"| {name} | " + " | ".join([*cells, last]) + " |"


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clusters", type=int, default=CLUSTERS)
    parser.add_argument("--views", type=int, default=VIEWS)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--report", type=Path)
    arguments = parser.parse_args()
    with ProcessPoolExecutor(arguments.processes) as pool:
        found = pool.map(evaluate, STUDY, repeat(arguments.clusters), repeat(arguments.views))
        results = list(found)
    print("\n".join([*forecast_table(results), "", *sizing_table(results)]))
    if arguments.report is not None:
        arguments.report.write_text(evaluation_page([r.evaluation for r in results]))


if __name__ == "__main__":
    main()
