"""What became of fruitlets on the visits whose pictures do not show them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fieldcam.growth.association.alignment import whereabouts
from fieldcam.growth.association.points import F64
from fieldcam.growth.association.poses import NONE
from fieldcam.growth.comparing import Picture
from fieldcam.growth.fate import FALLEN_FROM, LookedAt, chance_fallen, chance_found, may_be_there
from fieldcam.growth.places import ClusterVisit
from fieldcam.growth.records import Presence

Shown = Mapping[int, int]
"""One fruitlet: its index among the points of each picture that shows it."""
USUAL_DIAMETER_MM = 8.0
"""Of a fruitlet that never got a size."""
Chances = list[dict[int, float]]
"""For each fruitlet, by the index of a visit on which it is missing: that it has fallen."""


def chances_fallen(
    visits: Sequence[ClusterVisit], pictures: Sequence[Picture], fruitlets: Sequence[Shown]
) -> Chances:
    """By what the pictures show at the places where the fruitlets ought to hang."""
    return [_of_one(visits, pictures, fruitlets, shown) for shown in fruitlets]


def presences(
    visits: Sequence[ClusterVisit], pictures: Sequence[Picture], fruitlets: Sequence[Shown],
    chances: Chances,
) -> list[dict[int, Presence]]:  # fmt: skip
    """FALLEN or NOT_SEEN for each missing fruitlet and visit; the operator's word comes first."""
    found: list[dict[int, Presence]] = [{} for _ in fruitlets]
    last_seen = [max(pictures[k].visit for k in shown) for shown in fruitlets]
    for k, visit in enumerate(visits):
        missing = [n for n, chance in enumerate(chances) if k in chance]
        gone = [n for n in missing if found[n].get(k - 1) is Presence.FALLEN]
        told = {n: _told_of(visit, pictures, fruitlets[n]) for n in missing}
        open_ = sorted(set(missing) - set(gone), key=lambda n: (-told[n], -chances[n][k]))
        fell = _told(visit, [chances[n][k] for n in open_])
        for n in gone:
            found[n][k] = Presence.FALLEN
        for n, fallen in zip(open_, fell, strict=True):
            is_gone = fallen and last_seen[n] < k
            found[n][k] = Presence.FALLEN if is_gone else Presence.NOT_SEEN
    return found


def _told_of(visit: ClusterVisit, pictures: Sequence[Picture], shown: Shown) -> int:
    """What the operator said of this one: fallen 1, hidden -1."""
    places = {pictures[k].points.seen[n].place for k, n in shown.items()}
    return bool(places & visit.said_fallen) - bool(places & visit.said_hidden)


def _told(visit: ClusterVisit, chances: Sequence[float]) -> list[bool]:
    """Which of the missing have fallen, those first that are most likely to."""
    surely = len(chances) - visit.hidden
    return [
        k < surely and (k < visit.fallen or chance >= FALLEN_FROM)
        for k, chance in enumerate(chances)
    ]


def _of_one(
    visits: Sequence[ClusterVisit], pictures: Sequence[Picture], fruitlets: Sequence[Shown],
    shown: Shown,
) -> dict[int, float]:  # fmt: skip
    seen_on = sorted({pictures[k].visit for k in shown})
    after = range(seen_on[-1] + 1, len(visits))
    gaps = {k: 0.0 for k in range(seen_on[0], seen_on[-1]) if k not in seen_on}
    found: list[float] = []
    for visit in after:
        looked = _looked_at(visit, pictures, fruitlets, shown)
        clear = [each for each in looked if not may_be_there(each)]
        if looked and not clear:
            # Whoever may be there again says nothing of the visits before, either.
            found = [0.0] * (len(found) + 1)
        else:
            # The same leaves hide a place from all pictures of a visit: the best look counts.
            found.append(max(map(chance_found, clear), default=0.0))
    return gaps | dict(zip(after, chance_fallen(found), strict=True))


def _looked_at(
    visit: int, pictures: Sequence[Picture], fruitlets: Sequence[Shown], shown: Shown
) -> list[LookedAt]:
    """All pictures of a visit that do not show a fruitlet."""
    others = [k for k, picture in enumerate(pictures) if picture.visit == visit]
    return [_looked_at_from(k, pictures, fruitlets, shown) for k in others]


def _looked_at_from(
    other: int, pictures: Sequence[Picture], fruitlets: Sequence[Shown], shown: Shown
) -> LookedAt:
    """By the picture, of those of its last visit, that shares most fruitlets with the other."""
    last = max(pictures[k].visit for k in shown)
    partners = {
        k: _partners(k, other, pictures, fruitlets) for k in shown if pictures[k].visit == last
    }
    best = max(partners, key=lambda k: int((partners[k] != NONE).sum()))
    first, second = pictures[best], pictures[other]
    days = float((second.day - first.day).days)
    place = whereabouts(first.points, second.points, partners[best], days, [shown[best]])[0]
    size = first.points.seen[shown[best]].diameter_mm or USUAL_DIAMETER_MM
    new = _newcomers(other, last, pictures, fruitlets)
    return LookedAt(second.view, second.points, place, size, new)


def _newcomers(
    other: int, last: int, pictures: Sequence[Picture], fruitlets: Sequence[Shown]
) -> F64:
    """(M, 3) what a picture shows of fruitlets that no visit up to the last one shows."""
    own = pictures[other].points.centers_mm
    new = [
        shown[other]
        for shown in fruitlets
        if other in shown and min(pictures[k].visit for k in shown) > last
    ]
    return own[new]


def _partners(
    one: int, other: int, pictures: Sequence[Picture], fruitlets: Sequence[Shown]
) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    found = np.full(len(pictures[one].points.seen), NONE, np.intp)
    for shown in fruitlets:
        if one in shown and other in shown:
            found[shown[one]] = shown[other]
    return found
