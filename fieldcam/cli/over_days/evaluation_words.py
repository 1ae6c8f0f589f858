"""An evaluation as text: sizes, forecasts, fates and speed."""

from __future__ import annotations

from collections.abc import Iterator

from fieldcam.cli.console import table
from fieldcam.growth.agreement import ENOUGH
from fieldcam.growth.evaluation.evaluating import Evaluation, ReadingsScore, aapd
from fieldcam.growth.evaluation.sizing import SizingScore, only_by_calipers, only_by_camera
from fieldcam.words import number_of, span


def evaluation_lines(found: Evaluation) -> Iterator[str]:
    yield f"Block {found.block}: camera against calipers."
    for readings in found.readings:
        yield from (
            "",
            *_size_lines(readings),
            *_few_lines(readings),
            "",
            *_forecast_lines(found, readings),
            "",
        )
        yield from _missing_lines(readings)
    for what, seconds in found.seconds.items():
        faster = seconds.times_faster
        beside = "" if faster is None else f"; calipers take {faster:.1f} times as long"
        yield (
            f"Time for a cluster {what}: median {seconds.median_s:.1f} s,"
            f" mean {seconds.mean_s:.1f} s{beside}."
        )
    yield from found.notes


def _size_lines(readings: ReadingsScore) -> list[str]:
    rows = [
        ("visit", "by calipers", "sized %", "outliers", "MAE mm", "MAPE %", "R2 of line",
         "bias mm", "95 % limits mm"),
        *(_size_row(str(day), score) for day, score in readings.by_day.items()),
        _size_row("all", readings.all_days),
    ]  # fmt: skip
    return table(rows, "<>>>>>>>>")


def _size_row(visit: str, score: SizingScore) -> tuple[str, ...]:
    agreed = score.agreement
    limits = None if agreed is None else agreed.limits_mm
    return (
        visit,
        str(score.measured),
        _number(score.sized_pct, 1),
        str(score.outliers),
        _number(score.mae_mm, 3),
        _number(score.mape_pct, 1),
        _number(score.r2, 3),
        "-" if agreed is None else f"{agreed.bias_mm:+.2f}",
        "-" if limits is None else span(limits, "+.2f"),
    )


def _few_lines(readings: ReadingsScore) -> Iterator[str]:
    agreed = readings.all_days.agreement
    if agreed is not None and agreed.limits_mm is None:
        yield f"95 % limits are given from {ENOUGH} sizes on."


def _forecast_lines(found: Evaluation, readings: ReadingsScore) -> list[str]:
    truth_pct, known_pct = found.persist_pct, readings.known_persist_pct
    rows = [
        ("followed by", "stay %", "fall %", "AAPD", "precision %", "recall %"),
        ("calipers", *_forecast(truth_pct), "", "", ""),
        ("names", *_forecast(known_pct), _number(aapd(known_pct, truth_pct), 1), "", ""),
    ]
    rows += [
        (
            str(run.method),
            *_forecast(run.persist_pct),
            _number(aapd(run.persist_pct, truth_pct), 1),
            _number(run.association.precision_pct, 1),
            _number(run.association.recall_pct, 1),
        )
        for run in readings.following
    ]
    return table(rows, "<>>>>>")


def _forecast(persist_pct: float | None) -> tuple[str, str]:
    abscise_pct = None if persist_pct is None else 100.0 - persist_pct
    return _number(persist_pct, 1), _number(abscise_pct, 1)


def _missing_lines(readings: ReadingsScore) -> Iterator[str]:
    for run in readings.following[:1]:
        if run.fates.right_pct is not None:
            yield f"What was said of missing fruitlets was right in {run.fates.right_pct:.1f} %."
    one, other = only_by_calipers(readings.pairs), only_by_camera(readings.pairs)
    yield f"Measured by calipers, and in no picture of that day: {number_of(len(one), 'size')}."
    yield f"Measured by camera, and not by calipers: {number_of(len(other), 'size')}."
    yield f"Without a name in their picture: {number_of(readings.unnamed, 'fruitlet')}."


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
