"""A cluster's fruitlets followed over its visits (paper, "Growth Rate Tracking")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate

import numpy as np

from fieldcam.growth.association.joining import join
from fieldcam.growth.comparing import ByPair, Picture, compare, log_odds, pictures_of
from fieldcam.growth.missing import Chances, Shown, chances_fallen, presences
from fieldcam.growth.places import (
    Association,
    ClusterVisit,
    MatchWord,
    SeenFruitlet,
    Track,
    TrackedVisit,
)
from fieldcam.growth.records import Presence, Sighting
from fieldcam.growth.size_rule import SizeRule, sighting_of


def track(
    visits: Sequence[ClusterVisit],
    method: Association = Association.GEOMETRY,
    words: Sequence[MatchWord] = (),
    size_rule: SizeRule | None = None,
) -> tuple[Track, ...]:
    """Each fruitlet of a cluster on all visits (rising days) from its first sight on.

    `size_rule` is that of the method where it is not named.
    """
    pictures = pictures_of(visits)
    certainties = compare(pictures, method)
    fruitlets = _fruitlets(pictures, log_odds(pictures, certainties, words))
    if method is Association.GEOMETRY:
        chances = chances_fallen(visits, pictures, fruitlets)
    else:
        chances = _undecided(visits, pictures, fruitlets)
    fates = presences(visits, pictures, fruitlets, chances)
    rule = size_rule or method.size_rule
    return tuple(
        _track(number, visits, pictures, shown, fate, certainties, words, rule)
        for number, (shown, fate) in enumerate(zip(fruitlets, fates, strict=True), start=1)
    )


def _fruitlets(pictures: Sequence[Picture], odds: ByPair) -> list[Shown]:
    """In the order of first sight, the largest first."""
    counts = [len(p.points.seen) for p in pictures]
    start = [0, *accumulate(counts)]
    found: list[Shown] = []
    for group in join(counts, odds):
        members = np.searchsorted(start, group, side="right") - 1
        found.append({int(k): n - start[k] for k, n in zip(members, group, strict=True)})
    return sorted(found, key=lambda shown: _order(pictures, shown))


def _order(pictures: Sequence[Picture], shown: Shown) -> tuple[int, float]:
    first = min(shown)
    return pictures[first].visit, -(pictures[first].points.seen[shown[first]].diameter_mm or 0.0)


def _undecided(
    visits: Sequence[ClusterVisit], pictures: Sequence[Picture], fruitlets: Sequence[Shown]
) -> Chances:
    """Other ways of association know nothing of what is missing."""
    found = []
    for shown in fruitlets:
        seen_on = {pictures[k].visit for k in shown}
        later = range(min(seen_on), len(visits))
        found.append({k: 0.0 for k in later if k not in seen_on})
    return found


def _track(
    number: int,
    visits: Sequence[ClusterVisit],
    pictures: Sequence[Picture],
    shown: Shown,
    fate: dict[int, Presence],
    certainties: ByPair,
    words: Sequence[MatchWord],
    size_rule: SizeRule,
) -> Track:
    said = {place for word in words for place in (word.one, word.other) if place is not None}
    tracked = {}
    for k, visit in enumerate(visits):
        here = {p: n for p, n in shown.items() if pictures[p].visit == k}
        seen = [pictures[p].points.seen[n] for p, n in here.items()]
        if seen:
            places = tuple(s.place for s in seen)
            fallen = any(
                pictures[p].view.fallen & {s.place.fruitlet}
                for p, s in zip(here, seen, strict=True)
            )
            by_hand = bool(said & set(places))
            confidence = 1.0 if by_hand else _confidence(here, shown, certainties)
            sighting = _sighting(seen, fallen, confidence, size_rule)
            tracked[visit.day] = TrackedVisit(sighting, places, by_hand)
        elif k in fate:
            tracked[visit.day] = TrackedVisit(Sighting(fate[k]), ())
    return Track(number, tracked)


def _sighting(
    seen: Sequence[SeenFruitlet], fallen: bool, confidence: float, size_rule: SizeRule
) -> Sighting:
    if fallen:
        return Sighting(Presence.FALLEN, None, confidence)
    return replace(sighting_of(seen, size_rule), confidence=confidence)


def _confidence(here: Shown, shown: Shown, certainties: ByPair) -> float:
    """Mean certainty against the pictures before; 1 where there are none."""
    found = [
        float(certainties[other, p][shown[other], n])
        for p, n in here.items()
        for other in shown
        if other not in here and (other, p) in certainties
    ]
    return float(np.mean(found)) if found else 1.0
