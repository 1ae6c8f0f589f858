"""What a grower should know before believing a forecast."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from statistics import mean

from fieldcam.growth.forecast import Forecast, FruitletState
from fieldcam.growth.records import FruitletRecord, SizeSource
from fieldcam.growth.reference import FASTEST
from fieldcam.growth.sprays import SprayDay, last_spray
from fieldcam.growth.visits import MIN_DAYS, undecided_pictures, unread_pictures, visits_of
from fieldcam.growth.warnings.dates import doubtful_dates
from fieldcam.growth.warnings.doubts import MAX_MM_PER_DAY, SURE, Doubt
from fieldcam.growth.warnings.tags import (
    emptied_clusters,
    mixed_up_clusters,
    named,
    other_clusters,
    tags_changed,
)
from fieldcam.words import number_of

MIN_START_MM = 6.0
MIN_DAYS_AFTER_SPRAY = 9
FEWEST_CLUSTERS = 50
MAX_NOT_SEEN = 0.1
REFERENCE_MM_PER_DAY = (0.3, 1.5)
MAX_APART_POINTS = 3.0
Check = Callable[[Forecast], str | None]


@dataclass(frozen=True, slots=True)
class Warning:
    """One reason for doubt; `code` stays the same, `text` is a sentence for the grower."""

    code: str
    text: str


def warnings_about(
    found: Forecast,
    sprays: Sequence[SprayDay] = (),
    by_size_order: Forecast | None = None,
    today: date | None = None,
) -> tuple[Warning, ...]:
    """All that speaks against a forecast.

    `by_size_order` is the same forecast with fruitlets matched by size order alone; `today`
    is what the clock says, None where the block's days are made up.
    """
    return tuple(_warnings(found, sprays, by_size_order, today))


def _warnings(
    found: Forecast, sprays: Sequence[SprayDay], by_size_order: Forecast | None, today: date | None
) -> Iterator[Warning]:
    yield from (Warning(*doubt) for doubt in doubtful_dates(found.block.visits, today))
    for code, check in _CHECKS.items():
        if text := check(found):
            yield Warning(code, text)
    if text := _soon_after_spray(found, sprays):
        yield Warning("soon_after_spray", text)
    if text := _sprayed_since(found, sprays):
        yield Warning("sprayed_since", text)
    if by_size_order is not None and (text := _apart(found, by_size_order)):
        yield Warning("size_order_differs", text)


def _short_interval(found: Forecast) -> str | None:
    if found.days >= MIN_DAYS:
        return None
    return (
        f"The two visits are {number_of(round(found.days), 'day')} apart; growth over less than"
        f" {MIN_DAYS} days lies inside the measuring errors."
    )


def _small_fruit(found: Forecast) -> str | None:
    start_mm = mean(each.growth.start_mm for each in found.fruitlets if each.growth is not None)
    if start_mm >= MIN_START_MM:
        return None
    return (
        f"The fruitlets measured {start_mm:.1f} mm on average at the first of the two visits;"
        f" below {MIN_START_MM:.0f} mm it is too early."
    )


def _few_clusters(found: Forecast) -> str | None:
    clusters = len(visits_of(found.block)[0].clusters)
    if clusters >= FEWEST_CLUSTERS:
        return None
    return (
        f"The first visit holds only {number_of(clusters, 'cluster')}; with fewer than"
        f" {FEWEST_CLUSTERS} the forecast says little about the other trees."
    )


def _few_fruitlets(found: Forecast) -> str | None:
    if found.reference.n >= FASTEST:
        return None
    return (
        f"A growth rate is known of only {number_of(found.reference.n, 'fruitlet')}: the reference"
        f" is the mean of all, not of the {FASTEST} fastest, so the cutoff is too low."
    )


def _many_not_seen(found: Forecast) -> str | None:
    counts = found.counts
    if counts.not_seen <= MAX_NOT_SEEN * counts.initial:
        return None
    return (
        f"Left out for want of a size on one of the two visits: {counts.not_seen} of"
        f" {number_of(counts.initial, 'fruitlet')}; more than {MAX_NOT_SEEN:.0%} make the forecast"
        " doubtful."
    )


def _clusters_missed(found: Forecast) -> str | None:
    everywhere = visits_of(found.block)[0].clusters
    missed = [
        f"{len(everywhere - visit.clusters)} on {visit}"
        for visit in (found.start, found.end)
        if everywhere - visit.clusters
    ]
    if not missed:
        return None
    return (
        f"Of the {number_of(len(everywhere), 'cluster')} of the first visit some have no sizes:"
        f" {', '.join(missed)}; their fruitlets count as not seen."
    )


def _unread_pictures(found: Forecast) -> str | None:
    return unread_pictures(found.block)


def _undecided_pictures(found: Forecast) -> str | None:
    return undecided_pictures(found.block)


def _clusters_added(found: Forecast) -> str | None:
    added = (found.start.clusters | found.end.clusters) - visits_of(found.block)[0].clusters
    if not added:
        return None
    return (
        f"Measured since, but not on the first visit: {number_of(len(added), 'cluster')}, whose"
        " fruitlets count as new and are left out."
    )


def _no_first_size(found: Forecast) -> str | None:
    """An empty cell was perhaps forgotten; what a camera sees later was often hidden."""
    first = visits_of(found.block)[0]
    if found.block.source is not SizeSource.CALIPERS:
        return None
    late = [
        _name(each.fruitlet)
        for each in found.fruitlets
        if each.state is FruitletState.NEW and each.fruitlet.tag_id in first.clusters
    ]
    if not late:
        return None
    return (
        f"Without a size on the first visit ({first}), and so not counted:"
        f" {number_of(len(late), 'fruitlet')} ({named(late)})."
    )


def _odd_reference(found: Forecast) -> str | None:
    low, high = REFERENCE_MM_PER_DAY
    rate = found.reference.rate_mm_per_day
    if low <= rate <= high:
        return None
    return (
        f"The fastest fruitlets grew {rate:.2f} mm/day; {low} to {high} is usual. Are the sizes"
        " in mm, and the dates right?"
    )


def _odd_growth(found: Forecast) -> str | None:
    sentences = [
        f"{number_of(len(odd), 'fruitlet')} {did}, which no fruitlet does; {counted}:"
        f" {named(list(map(_name, odd)))}."
        for odd, did, counted in (
            (
                _doubted(found, Doubt.GROWTH, FruitletState.IGNORED),
                f"grew more than {MAX_MM_PER_DAY} mm/day",
                "left out, since a size must be wrong",
            ),
            (
                _doubted(found, Doubt.SHRUNK, FruitletState.ABSCISE),
                "shrank by more than measuring errors",
                "counted as falling, though a size or the match may be wrong",
            ),
        )
        if odd
    ]
    return " ".join(sentences) or None


def _doubtful_matches(found: Forecast) -> str | None:
    doubtful = _doubted(found, Doubt.MATCH)
    if not doubtful:
        return None
    return (
        f"The match of {number_of(len(doubtful), 'fruitlet')} is less than {SURE * 100:.0f} % sure:"
        f" {named(list(map(_name, doubtful)))}. The reference is made without them; look at them on"
        " Two days."
    )


def _doubted(
    found: Forecast, doubt: Doubt, state: FruitletState | None = None
) -> list[FruitletRecord]:
    """Whom a doubt is about; of one state only where it is named."""
    return [
        each.fruitlet
        for each in found.fruitlets
        if doubt in each.doubts and state in (None, each.state)
    ]


def _name(fruitlet: FruitletRecord) -> str:
    return f"fruitlet {fruitlet.fruitlet} of cluster {fruitlet.tag_id}"


def _first_interval(found: Forecast) -> str | None:
    if found.start.first != visits_of(found.block)[0].first:
        return None
    return (
        "This is the block's first interval, and early growth can mislead: measure once more"
        " before you decide."
    )


def _soon_after_spray(found: Forecast, sprays: Sequence[SprayDay]) -> str | None:
    spray = last_spray(sprays, found.end.first)
    if spray is None:
        return None
    since = (found.end.first - spray.sprayed_on).days
    if since >= MIN_DAYS_AFTER_SPRAY:
        return None
    return (
        f"The last spray was {number_of(since, 'day')} before the second visit; its effect shows"
        f" after about {MIN_DAYS_AFTER_SPRAY} days."
    )


def _sprayed_since(found: Forecast, sprays: Sequence[SprayDay]) -> str | None:
    since = sorted({each.sprayed_on for each in sprays if each.sprayed_on > found.end.days[-1]})
    if not since:
        return None
    return (
        f"Sprayed after the second visit ({', '.join(map(str, since))}): the forecast knows nothing"
        " of what that does. Is the date right?"
    )


def _apart(found: Forecast, other: Forecast) -> str | None:
    apart = abs(found.set_pct - other.set_pct)
    if apart <= MAX_APART_POINTS:
        return None
    return (
        f"Matched by size order alone, {other.set_pct:.1f} % would stay,"
        f" {apart:.1f} points away: look at how the fruitlets were matched."
    )


_CHECKS: dict[str, Check] = {
    "short_interval": _short_interval,
    "small_fruitlets": _small_fruit,
    "first_interval": _first_interval,
    "few_clusters": _few_clusters,
    "few_fruitlets": _few_fruitlets,
    "many_not_seen": _many_not_seen,
    "clusters_missed": _clusters_missed,
    "unread_pictures": _unread_pictures,
    "undecided_pictures": _undecided_pictures,
    "clusters_added": _clusters_added,
    "no_first_size": _no_first_size,
    "odd_reference": _odd_reference,
    "odd_growth": _odd_growth,
    "doubtful_matches": _doubtful_matches,
    "mixed_up_clusters": mixed_up_clusters,
    "emptied_clusters": emptied_clusters,
    "other_clusters": other_clusters,
    "tags_changed": tags_changed,
}
