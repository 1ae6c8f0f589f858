"""How well fruitlets are followed over visits, where their names are known."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import pairwise

from fieldcam.growth.evaluation.named import NamedCluster
from fieldcam.growth.places import Place, Track
from fieldcam.growth.records import FruitletRecord, Presence


@dataclass(frozen=True, slots=True)
class AssociationScore:
    """Matches of fruitlets that have a size on both of two visits."""

    right: int
    made: int
    possible: int

    @property
    def precision_pct(self) -> float | None:
        return 100.0 * self.right / self.made if self.made else None

    @property
    def recall_pct(self) -> float | None:
        return 100.0 * self.right / self.possible if self.possible else None

    def __add__(self, other: AssociationScore) -> AssociationScore:
        return AssociationScore(
            self.right + other.right, self.made + other.made, self.possible + other.possible
        )


NO_MATCHES = AssociationScore(0, 0, 0)


@dataclass(frozen=True, slots=True)
class FateScore:
    """What was said of fruitlets that no picture of a visit shows, and what was true."""

    fallen: int
    """Said to have fallen, and they had."""
    fallen_but_hangs: int
    not_seen: int
    """Said to be not seen, and they hung there."""
    not_seen_but_fell: int

    @property
    def cases(self) -> int:
        """Visits on which something was said of a fruitlet, and the truth is known."""
        return self.fallen + self.not_seen + self.fallen_but_hangs + self.not_seen_but_fell

    @property
    def right_pct(self) -> float | None:
        """Share of the cases in which what was said is true."""
        return 100.0 * (self.fallen + self.not_seen) / self.cases if self.cases else None

    def __add__(self, other: FateScore) -> FateScore:
        return FateScore(
            self.fallen + other.fallen,
            self.fallen_but_hangs + other.fallen_but_hangs,
            self.not_seen + other.not_seen,
            self.not_seen_but_fell + other.not_seen_but_fell,
        )


NO_FATES = FateScore(0, 0, 0, 0)


def score_association(cluster: NamedCluster, tracks: Sequence[Track]) -> AssociationScore:
    """Of each visit with the next one.

    A match counts as right when its fruitlets have one name on both visits. Where neither
    has one, or a visit's pictures have no names at all, it is not judged.
    """
    days = [visit.day for visit in cluster.visits]
    scores = [_score_days(cluster, tracks, one, other) for one, other in pairwise(days)]
    return sum(scores, NO_MATCHES)


def score_fates(
    cluster: NamedCluster, tracks: Iterable[Track], truth: Mapping[str, FruitletRecord]
) -> FateScore:
    """Of visits whose pictures do not show a fruitlet and can tell why.

    Only as far as its name and the truth are known. Where a picture shows it after all, to be
    matched with another one is a mistake of association, and is counted there.
    """
    days = {visit.day for visit in cluster.visits}
    told = {(name, day) for day in days for name in cluster.seen_on(day)} | cluster.out_of_sight
    return sum((_score_fate(track, cluster.names, truth, told) for track in tracks), NO_FATES)


def _score_days(
    cluster: NamedCluster, tracks: Iterable[Track], one: date, other: date
) -> AssociationScore:
    possible = _sized(cluster, one) & _sized(cluster, other)
    named = {place.reading for place in cluster.names}
    right, made = set(), 0
    for track in tracks:
        ends = [track.visits.get(day) for day in (one, other)]
        places = [v.places for v in ends if v and v.sighting.presence is Presence.SIZED]
        names = [_names(here, cluster.names) for here in places]
        judged = all(any(p.reading in named for p in here) for here in places)
        if len(places) < 2 or not judged or not any(names):
            continue
        made += 1
        if len(names[0]) == 1 and names[0] == names[1]:
            right |= names[0] & possible
    return AssociationScore(len(right), made, len(possible))


def _score_fate(
    track: Track,
    names: Mapping[Place, str],
    truth: Mapping[str, FruitletRecord],
    told: Container[tuple[str, date]],
) -> FateScore:
    score, fruit = NO_FATES, None
    for day, visit in sorted(track.visits.items(), key=lambda entry: entry[0]):
        if visit.places:
            here = _names(visit.places, names)
            fruit = truth.get(here.pop()) if len(here) == 1 else None
            continue
        if fruit is None or (fruit.fruitlet, day) in told:
            continue
        known = fruit.sightings.get(day)
        if known is not None and known.presence is not Presence.NOT_SEEN:
            score += _fate(visit.sighting.presence, known.presence)
    return score


def _fate(said: Presence, true: Presence) -> FateScore:
    fell = true is Presence.FALLEN
    if said is Presence.FALLEN:
        return FateScore(int(fell), int(not fell), 0, 0)
    return FateScore(0, 0, int(not fell), int(fell))


def _sized(cluster: NamedCluster, day: date) -> set[str]:
    shown = cluster.seen_on(day)
    return {name for name, seen in shown.items() if any(s.diameter_mm is not None for s in seen)}


def _names(places: Iterable[Place], names: Mapping[Place, str]) -> set[str]:
    return {names[place] for place in places if place in names}
