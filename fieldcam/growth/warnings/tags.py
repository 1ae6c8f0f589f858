"""Doubts whether a tag still hangs at its cluster, and whether a cluster was measured at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median

from fieldcam.growth.forecast import Forecast, FruitletForecast, FruitletState
from fieldcam.growth.records import Presence, SizeSource
from fieldcam.growth.visits import BlockVisit, visits_of
from fieldcam.growth.warnings.doubts import Doubt
from fieldcam.words import number_of

MAX_SHRUNK_MM = 1.0
"""Of a cluster's median fruitlet: more than any measuring error."""
FEWEST = 2
"""Fruitlets of a cluster that say more together than one by itself."""
STRANGE_SHARE = 0.25
"""Of a cluster's fruitlets that two visits share: so few may be matched by chance."""
NAMED = 5
Hanging = Mapping[BlockVisit, frozenset[str]]
"""Names of a cluster's fruitlets that were seen, by visit."""


def mixed_up_clusters(found: Forecast) -> str | None:
    """A tag that hangs at another cluster than before shows other fruitlets."""
    odd = [str(tag) for tag, each in _by_tag(found).items() if _are_others(each)]
    if not odd:
        return None
    return (
        f"Fruitlets of {number_of(len(odd), 'cluster')} shrank by more than any measuring error:"
        f" was a tag moved or swapped? {named(odd)}."
    )


def emptied_clusters(found: Forecast) -> str | None:
    """Empty cells of a table say that fruit has fallen, but also that nobody measured."""
    empty = [str(tag) for tag in _emptied(found)]
    if not empty:
        return None
    return (
        f"All fruitlets of {number_of(len(empty), 'cluster')} count as fallen since"
        f" {found.start}: were they measured on {found.end}? {named(empty)}."
    )


def tags_changed(found: Forecast) -> str | None:
    """Where one tag ends another one begins."""
    ended = sorted({*_emptied(found), *(found.start.clusters - found.end.clusters)})
    begun = sorted(found.end.clusters - found.start.clusters)
    if not ended or not begun:
        return None
    return (
        f"Tag {named([str(tag) for tag in begun])} was first measured on {found.end}, when"
        f" tag {named([str(tag) for tag in ended])} had nothing any more: did a cluster get"
        " another tag? Then its fruit counts as fallen or not seen, and wrongly so."
    )


def other_clusters(found: Forecast) -> str | None:
    """Somebody may have photographed the neighbour; calipers know their fruit by name."""
    if found.block.source is not SizeSource.CAMERA:
        return None
    odd = [
        f"{tag} on {visit}"
        for tag, hanging in _hanging(found).items()
        for visit in _strange_visits(hanging)
    ]
    if not odd:
        return None
    return (
        "Nearly no fruitlet matches those of the cluster's other visits: were pictures of another"
        f" cluster stored under tag {named(odd)}?"
    )


def named(things: Sequence[str]) -> str:
    """The first few, and how many more there are."""
    more = len(things) - NAMED
    return ", ".join(things[:NAMED]) + (f" and {more} more" if more > 0 else "")


def _by_tag(found: Forecast) -> dict[int, list[FruitletForecast]]:
    clusters: dict[int, list[FruitletForecast]] = {}
    for each in found.fruitlets:
        clusters.setdefault(each.fruitlet.tag_id, []).append(each)
    return clusters


def _hanging(found: Forecast) -> Mapping[int, Hanging]:
    """By tag, up to the second of the two visits."""
    clusters: dict[int, dict[BlockVisit, frozenset[str]]] = {}
    visits = [visit for visit in visits_of(found.block) if visit.first <= found.end.first]
    for each in found.block.fruitlets:
        of_tag = clusters.setdefault(each.tag_id, {})
        for visit in visits:
            seen = visit.sighting(each)
            if seen is not None and seen[1].presence in (Presence.SIZED, Presence.SEEN):
                of_tag[visit] = of_tag.get(visit, frozenset()) | {each.fruitlet}
    return clusters


def _strange_visits(hanging: Hanging) -> list[BlockVisit]:
    """Visits that share nearly nothing with any other; of only two the second one."""
    several = {visit: names for visit, names in hanging.items() if len(names) >= FEWEST}
    strange = [
        visit
        for visit, names in several.items()
        if all(_are_strangers(names, several[other]) for other in several if other != visit)
    ]
    return (
        sorted(strange, key=lambda visit: visit.first)[1:]
        if len(strange) == len(several)
        else strange
    )


def _are_strangers(some: frozenset[str], others: frozenset[str]) -> bool:
    return len(some & others) <= STRANGE_SHARE * min(len(some), len(others))


def _are_others(fruitlets: Sequence[FruitletForecast]) -> bool:
    grown_mm = [each.growth.grown_mm for each in fruitlets if each.growth is not None]
    shrunk = sum(Doubt.SHRUNK in each.doubts for each in fruitlets)
    half = max(FEWEST, len(grown_mm) / 2)
    return shrunk >= half or bool(grown_mm and median(grown_mm) < -MAX_SHRUNK_MM)


def _emptied(found: Forecast) -> list[int]:
    """Clusters of several fruitlets on the first of the two visits, all of which have fallen."""
    return [
        tag
        for tag, fruitlets in _by_tag(found).items()
        if len(hung := [each for each in fruitlets if _hung(each, found)]) >= FEWEST
        and all(each.state is FruitletState.FALLEN for each in hung)
    ]


def _hung(each: FruitletForecast, found: Forecast) -> bool:
    sighting = found.start.sighting(each.fruitlet)
    return sighting is not None and sighting[1].diameter_mm is not None
