"""What the Growth screen says of a block's forecast; no widgets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fieldcam.growth.crop import CropForecast
from fieldcam.growth.influence import ClusterInfluence
from fieldcam.growth.outlook import Outlook
from fieldcam.growth.resampling import Interval
from fieldcam.tui.text.letters import BLOCK
from fieldcam.words import number_of, span

NO_BLOOM = "Count bloom clusters (E) to see fruit per tree."
LONGEST_TREE = 6
"""Letters of a tree's label that fit."""
CLUSTERS = ("tag", "tree", "first", "stay", "fall", "without")
WITHOUT = "without: what the forecast would be without that tag. Enter: its pictures."


def heading(growth: Outlook) -> str:
    """The two visits, and how long before the second one was sprayed."""
    found, spray, since = growth.found, growth.last_spray, growth.days_since_spray
    parts = [f"{found.start.first:%d %b} to {found.end.first:%d %b}"]
    parts.append(number_of(round(found.days), "day"))
    if spray is not None and since is not None:
        parts.append(f"{number_of(since, 'day')} after {spray.product}")
    return "   ".join(parts)


def verdict_lines(growth: Outlook, width: int) -> Iterator[str]:
    """The prediction against the target, and a bar of it `width` columns wide."""
    found, crop = growth.found, growth.crop
    trees = found.interval90_trees_pct
    yield (
        f"{found.set_pct:.0f} % of the first fruitlets will stay ({span(found.interval90_pct)} %;"
        f" on all trees {_of_trees(trees)})"
    )
    if crop is None:
        yield NO_BLOOM
        yield gauge(found.set_pct, trees, None, 100.0, width)
        return
    target, interval = crop.plan.target_fruit, crop.interval90_fruit
    if interval is None:
        yield f"{crop.fruit:.0f} fruit a tree, as far as one cluster can say"
    else:
        yield f"{crop.fruit:.0f} fruit a tree ({span(interval)}){_against(crop)}"
    most = 1.2 * max(crop.fruit, interval[1] if interval else 0.0, target or 0.0)
    yield gauge(crop.fruit, interval, target, most, width)


def number_lines(growth: Outlook) -> Iterator[str]:
    """What the prediction is made of."""
    found, counts, reference = growth.found, growth.found.counts, growth.found.reference
    fallen = f" ({counts.fallen} of them already)" if counts.fallen else ""
    left_out = f"; {counts.not_seen} not seen, left out" if counts.not_seen else ""
    yield (
        f"Of {number_of(counts.initial, 'fruitlet')} {counts.persist} stay,"
        f" {counts.abscise} fall{fallen}{left_out}"
    )
    yield (
        f"The {reference.n} fastest grew {reference.rate_mm_per_day:.2f} mm a day;"
        f" what grows above {reference.cutoff_mm_per_day:.2f} stays"
    )
    apart = growth.by_size_order.set_pct - found.set_pct
    yield (
        f"Matched by the order of sizes alone {growth.by_size_order.set_pct:.0f} % would stay"
        f" ({apart:+.0f} points)"
    )


def told_lines(growth: Outlook) -> Iterator[str]:
    """The trend over the visits, then the warnings."""
    if len(growth.trend) > 1:
        yield "Visit by visit"
        for each in growth.trend:
            days = f"{each.start.first:%d %b} to {each.end.first:%d %b}"
            yield f"  {days}  {each.set_pct:3.0f} %  ({span(each.interval90_pct)})"
    yield from (f"! {each.text}" for each in growth.warnings)


def cluster_lines(set_pct: float, clusters: Sequence[ClusterInfluence]) -> Iterator[str]:
    """The heading of a table, then a line for each cluster: which drive the prediction."""
    table = [CLUSTERS, *(_cluster(set_pct, each) for each in clusters)]
    widths = [max(len(row[n]) for row in table) for n in range(len(CLUSTERS))]
    for row in table:
        yield " ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))


def gauge(
    value: float, interval: Interval | None, target: float | None, most: float, width: int
) -> str:
    """From 0 to `most`: the interval in brackets, the prediction a block, the target a T."""
    room = max(8, width)

    def column(at: float) -> int:
        return min(max(0, round(at / most * (room - 1))), room - 1) if most > 0 else 0

    cells = ["─"] * room
    low, high = interval or (None, None)
    for at, glyph in ((low, "["), (high, "]"), (value, BLOCK), (target, "T")):
        if at is not None:
            cells[column(at)] = glyph
    return "".join(cells)


def _of_trees(interval: Interval | None) -> str:
    return "unknown from one cluster" if interval is None else f"{span(interval)} %"


def _against(crop: CropForecast) -> str:
    if not crop.against_target:
        return "; say in Set-up (E) how many a tree should carry"
    return f": {crop.against_target}"


def more_line(lines_below: int, lines_above: int) -> str:
    """That not all of the words are in view."""
    if lines_below > 0:
        return f"PgDn: {number_of(lines_below, 'more line')} below"
    return "PgUp: back up" if lines_above > 0 else ""


def _cluster(set_pct: float, each: ClusterInfluence) -> tuple[str, ...]:
    counts = each.counts
    return (
        str(each.tag_id),
        (each.tree or "")[:LONGEST_TREE],
        *(str(n) for n in (counts.initial, counts.persist, counts.abscise)),
        f"{set_pct - each.influence_points:.0f} %",
    )
