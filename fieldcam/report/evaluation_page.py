"""Camera against calipers as a page: the paper's tables and plots, beside the paper's figures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import date
from itertools import groupby

from fieldcam.growth.agreement import ENOUGH
from fieldcam.growth.evaluation.evaluating import (
    CALIPERS_S,
    Evaluation,
    FollowingScore,
    ReadingsScore,
    aapd,
)
from fieldcam.growth.evaluation.following import FateScore
from fieldcam.growth.evaluation.sizing import (
    OUTLIER_Z,
    SizePair,
    SizingScore,
    only_by_calipers,
    only_by_camera,
)
from fieldcam.growth.places import Association
from fieldcam.report.page import Html, element, figure, listing, page, section, table
from fieldcam.report.size_plots import Sets, bland_altman, line_fits, size_boxes, size_cdfs
from fieldcam.words import number_of, signed

NOTHING = "\N{EN DASH}"
FOLLOWED_BY = {
    Association.GEOMETRY: "geometry (fieldcam)",
    Association.PAPER: "ICP (the paper's)",
    Association.SIZE_ORDER: "size order",
}
PAPER_SIZES = (
    "The paper's range over its six sets, all days: MAE 0.597 to 0.739 mm, MAPE 7.9 to 10.2 %,"
    " sized 84.9 to 95.7 %, R² 0.724 to 0.899."
)
PAPER_FORECASTS = (
    "The paper's averages over its six sets: AAPD 3.75 points with known association and 3.33"
    " end to end, association precision 92.2 and recall 76.1 %; by size order 4.52 points, 46.1"
    " and 43.6 %; with SGBM stereo 10.5 and 10.9 points, 83.6 and 47.6 %."
)
METHOD = (
    "Fruit by camera and by calipers are matched by the names that were given to them in the"
    " pictures, never by size. Where two pictures of a day show a fruit, its better-known size"
    " counts: that of the smaller standard deviation, and the larger one where it is unknown.",
    f"Sizes by camera {OUTLIER_Z:g} or more standard deviations from their day's mean are left"
    " out of all figures but the share that was sized.",
    "R² is that of a straight line fitted to camera over calipers, as in the paper. It says how"
    " well a line fits and nothing of bias and scale; bias and limits of agreement do.",
    "Association: of matches between a visit and the next, of fruitlets sized on both. Precision:"
    " share of the matches made that are right. Recall: share of the possible ones that were made.",
    "Known association: fruitlets followed by name, and what no picture shows has fallen where"
    " the calipers say so. End to end: from pictures alone.",
    "AAPD: absolute difference of the share that falls (abscission) from that by calipers, in"
    " points.",
    f"Limits that hold 95 % are given from {ENOUGH} sizes on.",
)


def evaluation_page(found: Sequence[Evaluation]) -> str:
    """One block, or the sets of a study beside each other."""
    title = f"Camera against calipers: {', '.join(each.block for each in found)}"
    parts = [element("h1", title), *map(_summary, found), *_size_sections(found)]
    parts += [_forecast_section(found), _fate_section(found), _time_section(found)]
    parts.append(_unmatched_section(found))
    notes = [note for each in found for note in each.notes]
    parts.append(section("Method", listing([*METHOD, *notes])))
    return page(title, parts, any(each.simulated for each in found))


def _summary(found: Evaluation) -> Html:
    if not found.readings:
        return element("p", f"{found.block}: no pictures.", "verdict open")
    first = found.readings[0]
    score = first.all_days
    if score.agreement is None or score.mae_mm is None:
        text = f"{found.block}: no fruit was measured both ways, so that nothing can be said."
        return element("p", text, "verdict open")
    text = (
        f"{found.block}: {score.agreement.n:,} sizes compared, mean absolute error"
        f" {score.mae_mm:.2f} mm, bias {signed(score.agreement.bias_mm)} mm."
    )
    differences = [aapd(run.persist_pct, found.persist_pct) for run in first.following[:1]]
    for points in differences:
        if points is not None:
            text += f" The forecasts by camera and by calipers differ by {points:.1f} points."
    return element("p", text, "verdict open")


def _size_sections(found: Sequence[Evaluation]) -> Iterator[Html]:
    head = ["Visit", "By calipers", "Sized", "Outliers", "MAE mm", "MAPE", "R²", "Bias mm"]
    rows = [row for each in found for row in _size_rows(each)]
    yield section(
        "Sizes",
        table([*head, "95 % limits"], rows, "<>>>>>>>>"),
        element("p", PAPER_SIZES, "quiet"),
    )
    sets: Sets = {each.block: each.readings[0].pairs for each in found if each.readings}
    if any(p.error_mm is not None for pairs in sets.values() for p in pairs):
        yield section(
            "Distribution of sizes",
            figure(size_boxes(sets), "Means are crosses, medians bars."),
            figure(
                size_cdfs(sets),
                "Share of fruitlets up to a size; the later the day, the stronger the line.",
            ),
        )
        yield section(
            "Agreement",
            *(part for name, pairs in sets.items() for part in _agreement_figures(name, pairs)),
        )


def _agreement_figures(name: str, pairs: Sequence[SizePair]) -> Iterator[Html]:
    caption = f"{name}: dotted, equal sizes; the line is the best straight one."
    yield figure(line_fits(pairs), caption)
    yield figure(bland_altman(pairs), f"{name}: differences over mean sizes.")


def _size_rows(found: Evaluation) -> Iterator[list[str]]:
    for each in found.readings:
        yield [f"{found.block}, {each.name}"]
        for day, score in each.by_day.items():
            yield _size_row(_day(day), score)
        yield _size_row("all", each.all_days)


def _size_row(visit: str, score: SizingScore) -> list[str]:
    agreed = score.agreement
    limits = None if agreed is None else agreed.limits_mm
    return [
        visit,
        f"{score.measured:,}",
        _number(score.sized_pct, 1, " %"),
        f"{score.outliers:,}",
        _number(score.mae_mm, 3),
        _number(score.mape_pct, 1, " %"),
        _number(score.r2, 3),
        NOTHING if agreed is None else signed(agreed.bias_mm),
        NOTHING if limits is None else " to ".join(map(signed, limits)),
    ]


def _forecast_section(found: Sequence[Evaluation]) -> Html:
    head = ["Fruitlets followed by", "Stay", "Fall", "AAPD", "Precision", "Recall"]
    rows = [row for each in found for row in _forecast_rows(each)]
    return section(
        "Forecast and association",
        table(head, rows, "<>>>>>"),
        element("p", PAPER_FORECASTS, "quiet"),
    )


def _forecast_rows(found: Evaluation) -> Iterator[list[str]]:
    yield [found.block]
    yield ["calipers", *_persist(found.persist_pct), "", "", ""]
    for each in found.readings:
        of = f", {each.name}" if len(found.readings) > 1 else ""
        known = aapd(each.known_persist_pct, found.persist_pct)
        yield [
            f"their names{of}", *_persist(each.known_persist_pct), _number(known, 1), "", "",
        ]  # fmt: skip
        yield from (_end_to_end_row(found, run, of) for run in each.following)


def _end_to_end_row(found: Evaluation, run: FollowingScore, of: str) -> list[str]:
    return [
        f"{FOLLOWED_BY[run.method]}{of}",
        *_persist(run.persist_pct),
        _number(aapd(run.persist_pct, found.persist_pct), 1),
        _number(run.association.precision_pct, 1, " %"),
        _number(run.association.recall_pct, 1, " %"),
    ]


def _persist(pct: float | None) -> tuple[str, str]:
    if pct is None:
        return NOTHING, NOTHING
    return f"{pct:.1f} %", f"{100 - pct:.1f} %"


def _fate_section(found: Sequence[Evaluation]) -> Html:
    rows: list[list[str]] = []
    for each in found:
        for readings in each.readings:
            for run in readings.following:
                # The other ways know nothing of what is missing.
                if run.method is Association.GEOMETRY and run.fates.right_pct is not None:
                    rows += [[f"{each.block}, {readings.name}"], *_fate_rows(run.fates)]
    if not rows:
        return Html("")
    about = "Of fruitlets that no picture of a visit shows, as far as the calipers tell."
    head = ["What was said", "Times", "True", "Share"]
    return section("Fallen or not seen", element("p", about, "quiet"), table(head, rows, "<>>>"))


def _fate_rows(fates: FateScore) -> Iterator[list[str]]:
    for said, right, wrong in (
        ("fallen", fates.fallen, fates.fallen_but_hangs),
        ("not seen, but hanging", fates.not_seen, fates.not_seen_but_fell),
    ):
        share = f"{100 * right / (right + wrong):.1f} %" if right + wrong else NOTHING
        yield [said, str(right + wrong), str(right), share]


def _time_section(found: Sequence[Evaluation]) -> Html:
    head = ["Time for a cluster", "Clusters", "Mean", "Median", "Calipers take"]
    rows = [
        [
            f"{each.block}: {what}" if len(found) > 1 else what,
            f"{seconds.n:,}",
            f"{seconds.mean_s:.1f} s",
            f"{seconds.median_s:.1f} s",
            _number(seconds.times_faster, 1, " times as long"),
        ]
        for each in found
        for what, seconds in each.seconds.items()
    ]
    if not rows:
        return Html("")
    about = (
        f"Calipers take about {CALIPERS_S:g} s for a cluster, as growers say; the paper's pipeline"
        " is 6 times faster, counting its 4.7 s of computing alone."
    )
    return section("Speed", table(head, rows, "<>>>>"), element("p", about, "quiet"))


def _unmatched_section(found: Sequence[Evaluation]) -> Html:
    parts: list[Html] = []
    for each in found:
        for readings in each.readings[:1]:
            parts += _unmatched(each.block if len(found) > 1 else "", readings)
    return section("Measured one way only", *parts)


def _unmatched(block: str, readings: ReadingsScore) -> Iterator[Html]:
    sides = (
        ("by calipers, and in no picture of that day", only_by_calipers(readings.pairs)),
        ("by camera, and not by calipers on that day", only_by_camera(readings.pairs)),
    )
    of = f"{block}: " if block else ""
    for what, pairs in sides:
        yield element("p", f"{of}{number_of(len(pairs), 'size')} {what}.")
        yield listing(_by_day(pairs))
    unnamed = f"{of}{number_of(readings.unnamed, 'fruitlet')} in the pictures without a name."
    yield element("p", unnamed)


def _by_day(pairs: Iterable[SizePair]) -> Iterator[str]:
    for day, of_day in groupby(pairs, key=lambda pair: pair.day):
        clusters = groupby(of_day, key=lambda pair: pair.tag_id)
        names = [f"tag {tag}: {', '.join(p.fruit for p in of_tag)}" for tag, of_tag in clusters]
        yield f"{_day(day)}: {'; '.join(names)}"


def _number(value: float | None, digits: int, unit: str = "") -> str:
    return NOTHING if value is None else f"{value:.{digits}f}{unit}"


def _day(day: date) -> Html:
    """In one line."""
    return Html(f"{day.day}\N{NO-BREAK SPACE}{day:%b}\N{NO-BREAK SPACE}{day:%Y}")
