"""What `fieldcam evaluate` writes for scripts and spreadsheets."""

from __future__ import annotations

from collections.abc import Iterator

from fieldcam.exchange.json_form import Json
from fieldcam.exchange.rounding import each_rounded, rounded
from fieldcam.exchange.tables.written import csv_text
from fieldcam.growth.evaluation.evaluating import (
    Evaluation,
    FollowingScore,
    ReadingsScore,
    Seconds,
    aapd,
)
from fieldcam.growth.evaluation.following import AssociationScore, FateScore
from fieldcam.growth.evaluation.sizing import (
    SizePair,
    SizingScore,
    only_by_calipers,
    only_by_camera,
)

SCHEMA_VERSION = 1
ALL_DAYS = "all"
CSV_COLUMNS = ("block", "source", "day", "association", "measure", "value")


def evaluation_report(found: Evaluation) -> Json:
    """The document that `--json` prints, rounded to what means something.

    `r2` is that of a straight line fitted to camera over calipers, as in the paper;
    differences are camera less calipers.
    """
    return {
        "schema": SCHEMA_VERSION,
        "block": found.block,
        "simulated": found.simulated,
        "notes": list(found.notes),
        "calipers": _forecast(found.persist_pct),
        "readings": [_readings(each, found.persist_pct) for each in found.readings],
        "seconds_per_cluster": {what: _seconds(each) for what, each in found.seconds.items()},
    }


def evaluation_csv(found: Evaluation) -> str:
    """The same figures, one in each row; those that are not known are left out."""
    known = ((found.block, *row) for row in _csv_rows(found) if row[-1] is not None)
    return csv_text([CSV_COLUMNS, *known])


CsvRow = tuple[str, str, str, str, float | int | None]


def _csv_rows(found: Evaluation) -> Iterator[CsvRow]:
    yield from _measures("calipers", "", "", _forecast(found.persist_pct))
    for each in found.readings:
        for day, score in each.by_day.items():
            yield from _measures(each.name, day.isoformat(), "", _sizing(score))
        yield from _measures(each.name, ALL_DAYS, "", _sizing(each.all_days))
        yield (each.name, ALL_DAYS, "", "unnamed", each.unnamed)
        known = _judged(each.known_persist_pct, found.persist_pct)
        yield from _measures(each.name, "", "known", known)
        for run in each.following:
            figures = _flat(_following(run, found.persist_pct))
            yield from _measures(each.name, "", run.method.value, figures)
    for what, seconds in found.seconds.items():
        yield from _measures(what, "", "", _seconds(seconds))


def _measures(source: str, day: str, association: str, figures: Json) -> Iterator[CsvRow]:
    for measure, value in figures.items():
        if isinstance(value, list):
            yield from (
                (source, day, association, f"{measure}_{end}", number)
                for end, number in zip(("low", "high"), value, strict=True)
            )
        else:
            yield (source, day, association, measure, value)


def _flat(document: Json) -> Json:
    inner = {k: v for k, v in document.items() if isinstance(v, dict)}
    outer = {k: v for k, v in document.items() if k not in inner and k != "method"}
    return outer | {f"{k}_{each}": v for k, part in inner.items() for each, v in part.items()}


def _readings(found: ReadingsScore, truth_pct: float | None) -> Json:
    days = {day.isoformat(): _sizing(score) for day, score in found.by_day.items()}
    return {
        "name": found.name,
        "sizes": days | {ALL_DAYS: _sizing(found.all_days)},
        "known_association": _judged(found.known_persist_pct, truth_pct),
        "end_to_end": [_following(each, truth_pct) for each in found.following],
        "pairs": [_pair(pair) for pair in found.pairs],
        "only_by_camera": [_name(pair) for pair in only_by_camera(found.pairs)],
        "only_by_calipers": [_name(pair) for pair in only_by_calipers(found.pairs)],
        "unnamed": found.unnamed,
    }


def _sizing(score: SizingScore) -> Json:
    agreed = score.agreement
    limits = None if agreed is None else agreed.limits_mm
    return {
        "measured": score.measured,
        "sized": score.sized,
        "sized_pct": rounded(score.sized_pct, 2),
        "outliers": score.outliers,
        "mae_mm": rounded(score.mae_mm, 4),
        "mape_pct": rounded(score.mape_pct, 3),
        "r2": rounded(score.r2, 4),
        "bias_mm": rounded(None if agreed is None else agreed.bias_mm, 4),
        "limits95_mm": None if limits is None else each_rounded(limits, 4),
    }


def _following(run: FollowingScore, truth_pct: float | None) -> Json:
    return {
        "method": run.method.value,
        "association": _association(run.association),
        "fates": _fates(run.fates),
        **_judged(run.persist_pct, truth_pct),
    }


def _association(score: AssociationScore) -> Json:
    return {
        "right": score.right,
        "made": score.made,
        "possible": score.possible,
        "precision_pct": rounded(score.precision_pct, 2),
        "recall_pct": rounded(score.recall_pct, 2),
    }


def _fates(score: FateScore) -> Json:
    return {
        "fallen": score.fallen,
        "fallen_but_hangs": score.fallen_but_hangs,
        "not_seen": score.not_seen,
        "not_seen_but_fell": score.not_seen_but_fell,
        "right_pct": rounded(score.right_pct, 2),
    }


def _judged(persist_pct: float | None, truth_pct: float | None) -> Json:
    return _forecast(persist_pct) | {"aapd_pct": rounded(aapd(persist_pct, truth_pct), 2)}


def _forecast(persist_pct: float | None) -> Json:
    abscise_pct = None if persist_pct is None else 100.0 - persist_pct
    return {"persist_pct": rounded(persist_pct, 2), "abscise_pct": rounded(abscise_pct, 2)}


def _seconds(found: Seconds) -> Json:
    return {
        "clusters": found.n,
        "mean_s": round(found.mean_s, 2),
        "median_s": round(found.median_s, 2),
        "times_faster_than_calipers": rounded(found.times_faster, 1),
    }


def _pair(pair: SizePair) -> Json:
    return _name(pair) | {
        "camera_mm": rounded(pair.camera_mm, 3),
        "calipers_mm": rounded(pair.calipers_mm, 3),
        "outlier": pair.outlier,
    }


def _name(pair: SizePair) -> Json:
    return {"date": pair.day.isoformat(), "tag": pair.tag_id, "fruit": pair.fruit}
