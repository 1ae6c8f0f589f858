"""A block's forecast as text: what it means first, then the numbers behind it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fieldcam.cli.console import table
from fieldcam.growth.crop import CropForecast
from fieldcam.growth.forecast import Forecast
from fieldcam.growth.influence import ClusterInfluence
from fieldcam.growth.outlook import Outlook
from fieldcam.words import number_of, span


def growth_lines(growth: Outlook, notes: Sequence[str]) -> Iterator[str]:
    """`notes` are what was assumed, a sentence each."""
    found = growth.found
    yield (
        f"Block {found.block.name}, {found.start} to {found.end}:"
        f" {found.set_pct:.1f} % of the initial fruitlets will stay"
        f" ({span(found.interval90_pct, '.1f')} %)."
    )
    if growth.crop is not None:
        yield _fruit_line(growth.crop)
    yield from _number_lines(growth)
    yield from _listed("Warnings", [each.text for each in growth.warnings])
    yield from _listed("Assumed", notes)
    yield from _trend_lines(growth.trend)
    yield from ("", "Clusters, those that count most first:")
    yield from table(
        [("tag", "tree", "first", "stay", "fall", "fallen", "not seen", "influence")]
        + [_cluster_row(each) for each in growth.clusters],
        "><>>>>>>",
    )


def _fruit_line(crop: CropForecast) -> str:
    if crop.interval90_fruit is None:
        return f"Fruit per tree: {crop.fruit:.0f}, as far as one cluster can say."
    line = f"Fruit per tree: {crop.fruit:.0f} ({span(crop.interval90_fruit)})"
    return f"{line}; {crop.against_target}." if crop.against_target else f"{line}."


def _number_lines(growth: Outlook) -> Iterator[str]:
    found = growth.found
    counts, reference = found.counts, found.reference
    if found.interval90_trees_pct is None:
        yield "On all trees like these: one cluster cannot say."
    else:
        yield f"On all trees like these: {span(found.interval90_trees_pct, '.1f')} %."
    yield f"Matched by size order alone: {growth.by_size_order.set_pct:.1f} %."
    if growth.days_since_spray is not None:
        since = number_of(growth.days_since_spray, "day")
        yield f"The second visit was {since} after the last spray."
    yield ""
    yield (
        f"Of {number_of(counts.initial, 'fruitlet')} on the first visit: {counts.persist} will"
        f" stay, {counts.abscise} fall ({counts.fallen} of them fallen), {counts.not_seen}"
        f" left out without a growth rate{_ignored(found)}."
    )
    yield (
        f"Over {found.days:g} days the fastest ({reference.n}) grew"
        f" {reference.rate_mm_per_day:.2f} mm/day ({reference.measured_mm_per_day:.2f} as"
        f" measured); what grew more than {reference.cutoff_mm_per_day:.2f} stays."
    )


def _ignored(found: Forecast) -> str:
    if not found.ignored:
        return ""
    return f"; besides them {found.ignored} not counted, without a first size or with an odd one"


def _trend_lines(trend: Sequence[Forecast]) -> Iterator[str]:
    if len(trend) > 1:
        yield from ("", "Visit by visit:")
        for each in trend:
            likely = span(each.interval90_pct, ".1f")
            yield f"  {each.start} to {each.end}: {each.set_pct:.1f} % ({likely})"


def _listed(heading: str, sentences: Sequence[str]) -> Iterator[str]:
    if sentences:
        yield from ("", f"{heading}:")
        yield from (f"  {sentence}" for sentence in sentences)


def _cluster_row(each: ClusterInfluence) -> tuple[str, ...]:
    counts = each.counts
    numbers = (counts.initial, counts.persist, counts.abscise, counts.fallen, counts.not_seen)
    return (
        str(each.tag_id),
        each.tree or "",
        *map(str, numbers),
        f"{each.influence_points:+.2f}",
    )
