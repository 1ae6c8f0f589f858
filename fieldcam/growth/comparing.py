"""Every pair of a cluster's pictures that is worth comparing, compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import combinations, pairwise

import numpy as np

from fieldcam.growth.association.geometry import match_by_geometry
from fieldcam.growth.association.paper import match_by_paper
from fieldcam.growth.association.points import F64, Points, points_of
from fieldcam.growth.association.size_order import match_by_size_order
from fieldcam.growth.places import Association, ClusterVisit, MatchWord, Place, View

VISITS_APART = 2
"""Pictures are compared with those of so many visits before, and no further."""
STRONGEST = 6.0
"""No single pair of pictures speaks for or against a match with more than these log odds."""
SAID = 100.0
"""The log odds of the operator's word."""
ByPair = Mapping[tuple[int, int], F64]
"""For indices i < j of pictures, one number for each pair of their sightings (N_i, N_j)."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One picture of a cluster, ready to be compared."""

    visit: int
    """Index of its visit."""
    day: date
    view: View
    points: Points


def pictures_of(visits: Sequence[ClusterVisit]) -> list[Picture]:
    """All pictures, visit by visit."""
    return [
        Picture(k, visit.day, view, points_of(view))
        for k, visit in enumerate(visits)
        for view in visit.views
    ]


def compare(pictures: Sequence[Picture], method: Association) -> ByPair:
    """The certainty, 0 to 1, that two sightings are one fruitlet."""
    pairs = _near_pairs(pictures) if method is Association.GEOMETRY else _chain(pictures)
    return {(i, j): _certainty(pictures[i], pictures[j], method) for i, j in pairs}


def log_odds(
    pictures: Sequence[Picture], certainties: ByPair, words: Sequence[MatchWord]
) -> ByPair:
    """The certainties as log odds, with the operator's words above them."""
    odds = {pair: _bounded(certainty) for pair, certainty in certainties.items()}
    where = {
        seen.place: (k, n) for k, p in enumerate(pictures) for n, seen in enumerate(p.points.seen)
    }
    for word in words:
        _say(odds, pictures, where, word)
    return odds


def _certainty(first: Picture, second: Picture, method: Association) -> F64:
    match method:
        case Association.GEOMETRY:
            days = float((second.day - first.day).days)
            return match_by_geometry(first.points, second.points, days)
        case Association.PAPER:
            return match_by_paper(first.points, second.points)
        case Association.SIZE_ORDER:
            return match_by_size_order(first.points, second.points)


def _near_pairs(pictures: Sequence[Picture]) -> Iterator[tuple[int, int]]:
    for i, j in combinations(range(len(pictures)), 2):
        if pictures[j].visit - pictures[i].visit <= VISITS_APART:
            yield i, j


def _chain(pictures: Sequence[Picture]) -> Iterator[tuple[int, int]]:
    """As in the paper: within each visit, then from each visit's fullest picture to the next's."""
    fullest: dict[int, int] = {}
    for k, picture in enumerate(pictures):
        best = fullest.setdefault(picture.visit, k)
        if len(picture.points.seen) > len(pictures[best].points.seen):
            fullest[picture.visit] = k
    for k, picture in enumerate(pictures):
        if k != fullest[picture.visit]:
            yield min(k, fullest[picture.visit]), max(k, fullest[picture.visit])
    order = list(fullest.values())
    yield from pairwise(order)


def _bounded(certainty: F64) -> F64:
    with np.errstate(divide="ignore"):
        odds = np.log(certainty) - np.log1p(-certainty.clip(max=1.0))
    return np.asarray(odds.clip(-STRONGEST, STRONGEST))


def _say(
    odds: dict[tuple[int, int], F64],
    pictures: Sequence[Picture],
    where: Mapping[Place, tuple[int, int]],
    word: MatchWord,
) -> None:
    """A word about a picture that is not compared any more changes nothing."""
    if word.one not in where:
        return
    picture, row = where[word.one]
    if word.other is None:
        others = [k for k, p in enumerate(pictures) if p.view.id == word.not_in]
    else:
        others = [where[word.other][0]] if word.other in where else []
    for other in others:
        pair = min(picture, other), max(picture, other)
        sizes = tuple(len(pictures[k].points.seen) for k in pair)
        said = odds.setdefault(pair, np.zeros(sizes))
        turned = said if pair[0] == picture else said.T
        turned[row] = -SAID
        if word.other is not None:
            turned[:, where[word.other][1]] = -SAID
            turned[row, where[word.other][1]] = SAID
