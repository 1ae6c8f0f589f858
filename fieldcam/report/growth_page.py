"""A block's forecast as a page that a grower can print and keep."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from fieldcam.growth.crop import CropVerdict
from fieldcam.growth.following import visits_between
from fieldcam.growth.forecast import Forecast, FruitletForecast, FruitletState
from fieldcam.growth.grown import Measured, ends_of
from fieldcam.growth.influence import ClusterInfluence
from fieldcam.growth.outlook import Outlook
from fieldcam.growth.records import SizeSource
from fieldcam.growth.reference import FASTEST, PERSISTS_ABOVE
from fieldcam.growth.visits import BlockVisit, visits_of
from fieldcam.growth.warnings.doubts import SURE, Doubt, doubts_told
from fieldcam.report.growth_plots import rate_histogram, trend_plot
from fieldcam.report.page import (
    Html,
    element,
    escaped,
    figure,
    listing,
    page,
    picture,
    section,
    table,
)
from fieldcam.words import give_or_take, number_of, signed, span

PNG = b"\x89PNG"
"""How such a file begins; all other pictures are JPEG."""
LOOKS = {CropVerdict.TOO_MANY: "bad", CropVerdict.ON_TARGET: "good", CropVerdict.TOO_FEW: "bad"}
"""Classes of the page's style."""
STATES = {
    FruitletState.PERSIST: "stays",
    FruitletState.ABSCISE: "will fall",
    FruitletState.FALLEN: "has fallen",
    FruitletState.NOT_SEEN: "not seen",
    FruitletState.NEW: "new, not counted",
    FruitletState.IGNORED: "left out",
}
MEASURED_BY = {SizeSource.CAMERA: "camera", SizeSource.CALIPERS: "calipers"}


def growth_page(
    growth: Outlook,
    notes: Sequence[str] = (),
    thumbnails: Mapping[int, bytes] | None = None,
    simulated: bool = False,
) -> str:
    """The verdict first, then what it rests on, then how it was found.

    `notes` are what was assumed, a sentence each; `thumbnails` a picture of each cluster
    (JPEG or PNG) by its tag, as far as there are any.
    """
    found = growth.found
    title = f"Fruit set of {found.block.name}"
    parts = [
        element("h1", title),
        element("p", _occasion(growth), "quiet"),
        _verdict(growth),
        listing([each.text for each in growth.warnings], "warnings"),
        section("The count", _counts(growth)),
        _trend_section(growth),
        _rate_section(found),
        _cluster_section(growth, thumbnails or {}),
        section("Method", listing([*_method(found), *notes])),
    ]
    return page(title, parts, simulated)


def _occasion(growth: Outlook) -> str:
    found = growth.found
    clusters = len(visits_of(found.block)[0].clusters)
    return (
        f"Growth from {_visit(found.start)} to {_visit(found.end)} ({found.days:g} days),"
        f" measured by {MEASURED_BY[found.block.source]}; {number_of(clusters, 'cluster')},"
        f" {number_of(found.counts.initial, 'fruitlet')} on the first visit.{_sprayed(growth)}"
    )


def _sprayed(growth: Outlook) -> str:
    spray, since = growth.last_spray, growth.days_since_spray
    if spray is None or since is None:
        return ""
    what = f"spray of {spray.product}" if spray.product else "spray"
    return f" The last {what} was {number_of(since, 'day')} before the second visit."


def _verdict(growth: Outlook) -> Html:
    found, crop = growth.found, growth.crop
    of_first = (
        f"{found.set_pct:.0f} % of the first fruitlets will stay"
        f" ({span(found.interval90_pct)} %; on all trees {_of_trees(found)})"
    )
    if crop is None:
        return element("p", f"{of_first}.", "verdict open")
    if crop.interval90_fruit is None:
        text = f"{crop.fruit:.0f} fruit per tree, as far as one cluster can say: {of_first}."
        return element("p", text, "verdict open")
    fruit = f"{crop.fruit:.0f} fruit per tree (90 % interval {span(crop.interval90_fruit)})"
    if crop.verdict is None:
        return element("p", f"{fruit}: {of_first}.", "verdict open")
    text = f"{fruit}, {crop.against_target}. {of_first}."
    return element("p", text, f"verdict {LOOKS[crop.verdict]}")


def _of_trees(found: Forecast) -> str:
    interval = found.interval90_trees_pct
    return "unknown from one cluster" if interval is None else f"{span(interval)} %"


def _counts(growth: Outlook) -> Html:
    found = growth.found
    counts, reference = found.counts, found.reference
    rows = [
        ["Fruitlets on the first visit", str(counts.initial)],
        ["of these, stay", str(counts.persist)],
        ["of these, fall", f"{counts.abscise} ({counts.fallen} of them fallen)"],
        ["of these, without a growth rate, left out", str(counts.not_seen)],
        ["besides these, without a first size or with an odd one", str(found.ignored)],
        ["Set of the tagged clusters", f"{found.set_pct:.1f} % ({span(found.interval90_pct)} %)"],
        ["Set of all trees like them", _of_trees(found)],
        [f"Reference, the fastest ({reference.n})", f"{reference.rate_mm_per_day:.2f} mm/day"],
        ["Cutoff", f"{reference.cutoff_mm_per_day:.2f} mm/day"],
        ["Set if matched by size order", f"{growth.by_size_order.set_pct:.1f} %"],
    ]
    if growth.crop is not None:
        plan = growth.crop.plan
        rows.append(["Flower clusters of a tree", f"{plan.bloom_clusters:g}"])
    return table(["", ""], rows, "<>")


def _trend_section(growth: Outlook) -> Html:
    if len(growth.trend) < 2:
        text = "There is one forecast so far; a third visit will show whether it holds."
        return section("From visit to visit", element("p", text))
    plan = None if growth.crop is None else growth.crop.plan
    days = [spray.sprayed_on for spray in growth.sprays]
    drawn = trend_plot(growth.trend, days, plan)
    caption = "Each visit's forecast with its 90 % interval for all trees like the tagged ones."
    return section("From visit to visit", figure(drawn, caption))


def _rate_section(found: Forecast) -> Html:
    caption = (
        f"Who grows more than the cutoff stays. Without a rate: {found.counts.fallen} fallen and"
        f" {found.counts.not_seen} left out."
    )
    return section("Growth rates", figure(rate_histogram(found), caption))


def _cluster_section(growth: Outlook, thumbnails: Mapping[int, bytes]) -> Html:
    by_tag: dict[int, list[FruitletForecast]] = {}
    for each in growth.found.fruitlets:
        by_tag.setdefault(each.fruitlet.tag_id, []).append(each)
    rows = [
        _cluster_row(each, by_tag[each.tag_id], growth.found, thumbnails)
        for each in growth.clusters
    ]
    head = ["Cluster", "Fruitlets", "Stay", "Fall", "Not seen", "Points"]
    about = (
        "Those that count most first. Points: by how much the block's set is higher with the"
        " cluster than without it."
    )
    columns = "<<>>>>"
    if thumbnails:
        head, columns = ["", *head], f"<{columns}"
    return section("Clusters", element("p", about, "quiet"), table(head, rows, columns))


def _cluster_row(
    cluster: ClusterInfluence,
    fruitlets: Sequence[FruitletForecast],
    found: Forecast,
    thumbnails: Mapping[int, bytes],
) -> list[str]:
    name = [f"tag {cluster.tag_id}", *([] if cluster.tree is None else [f"tree {cluster.tree}"])]
    row = [
        _lines(name),
        _lines(_fruitlet(each, found) for each in fruitlets),
        str(cluster.counts.persist),
        str(cluster.counts.abscise),
        str(cluster.counts.not_seen),
        signed(cluster.influence_points, 1),
    ]
    if not thumbnails:
        return row
    data = thumbnails.get(cluster.tag_id)
    return ["" if data is None else _picture(data, f"The cluster at {name[0]}"), *row]


def _fruitlet(each: FruitletForecast, found: Forecast) -> str:
    visits = visits_between(found.block, found.start, found.end)
    began, ended = ends_of(each.fruitlet, visits)
    later = began is not None and began[0] not in found.start.days
    since = f" ({began[0]:%d %b})" if began is not None and later else ""
    grown = f"{_size(began)}{since} \N{RIGHTWARDS ARROW} {_size(ended)}"
    doubtful = f" (doubtful: {_doubts(each, found, began, ended)})" if each.doubts else ""
    return f"{each.fruitlet.fruitlet}: {grown} {STATES[each.state]}{doubtful}"


def _doubts(
    each: FruitletForecast, found: Forecast, began: Measured | None, ended: Measured | None
) -> str:
    days = [known[0] for known in (began, ended) if known is not None]
    return "; ".join(doubts_told(each.fruitlet, days, found.block.source))


def _lines(lines: Iterable[str]) -> Html:
    return element("span", Html("<br>".join(map(escaped, lines))), "lines")


def _size(known: Measured | None) -> str:
    if known is None or known[1].diameter_mm is None:
        return "\N{EN DASH}"
    digits = 1 if known[1].sd_mm is None else 2
    return f"{known[1].diameter_mm:.{digits}f}{give_or_take(known[1].sd_mm)}"


def _picture(data: bytes, says: str) -> Html:
    return picture(data, "image/png" if data.startswith(PNG) else "image/jpeg", says)


def _method(found: Forecast) -> Iterator[str]:
    yield (
        "Fruitlet growth model (Greene et al. 2013): a fruitlet stays when it grows faster than"
        f" {PERSISTS_ABOVE:.0%} of the mean of the {FASTEST} fastest of the block."
    )
    yield _counted(found)
    yield (
        "The interval of the tagged clusters is what measuring errors leave open; that of all"
        " trees also holds the chance of which clusters were tagged."
    )
    if any(Doubt.MATCH in each.doubts for each in found.fruitlets):
        yield f"Matches that are less than {SURE * 100:.0f} % sure are no part of the reference."
    measured, used = found.reference.measured_mm_per_day, found.reference.rate_mm_per_day
    if measured != used:
        yield (
            f"As measured, the fastest grew {measured:.2f} mm/day; the reference of {used:.2f}"
            " mm/day allows for measuring errors and for fruitlets that were not seen."
        )


def _counted(found: Forecast) -> str:
    late = (
        ", also those that a later picture of their cluster shows first, since they were small or"
        " hidden"
    )
    return (
        "The set is counted of all fruitlets that hung on the block's first visit"
        f"{late if found.block.source is SizeSource.CAMERA else ''}: those that have fallen stay in"
        " it, those without a growth rate are left out of both counts."
    )


def _visit(visit: BlockVisit) -> str:
    return " and ".join(f"{day.day} {day:%B %Y}" for day in visit.days)
