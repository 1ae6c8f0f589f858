"""From pairs of pictures to whole fruitlets: one-to-one over all pictures at once.

Every pair of sightings in two compared pictures speaks for or against being one fruitlet.
Groups are joined, the best pair first, as long as the sum of what their members say of each
other is in favour; no picture shows two of a group.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from fieldcam.growth.association.points import F64

NEVER = -1e9


def join(pictures: Sequence[int], odds: Mapping[tuple[int, int], F64]) -> list[list[int]]:
    """Groups of sightings, numbered through all pictures in their order.

    `pictures` holds how many sightings each picture has; `odds` of pictures (i, j), i < j,
    are the log odds (N_i, N_j) that two sightings are one fruitlet.
    """
    favour = _favour(pictures, odds)
    groups = [[k] for k in range(len(favour))]
    between = favour.copy()
    while len(groups) > 1:
        one, other = sorted(divmod(int(np.argmax(between)), len(groups)))
        if between[one, other] <= 0:
            break
        groups[one] += groups.pop(other)
        between[one] += between[other]
        between[:, one] += between[:, other]
        between = np.delete(np.delete(between, other, axis=0), other, axis=1)
        between[one, one] = NEVER
    return _settled(groups, favour)


def _favour(pictures: Sequence[int], odds: Mapping[tuple[int, int], F64]) -> F64:
    """(S, S), 0 where nobody compared two sightings."""
    start = np.concatenate([[0], np.cumsum(pictures)]).astype(int)
    favour = np.zeros((start[-1], start[-1]))
    for (i, j), found in odds.items():
        favour[start[i] : start[i + 1], start[j] : start[j + 1]] = found
        favour[start[j] : start[j + 1], start[i] : start[i + 1]] = found.T
    for one, other in pairwise(start):
        favour[one:other, one:other] = NEVER
    return favour


def _settled(groups: list[list[int]], favour: F64) -> list[list[int]]:
    """Single sightings move to where they are spoken for more, until none does."""
    count = len(favour)
    member = np.empty(count, np.intp)
    for k, group in enumerate(groups):
        member[group] = k
    for _ in range(count):
        before = member.copy()
        for sighting in range(count):
            pull = np.zeros(int(member.max()) + 2)
            others = np.arange(count) != sighting
            np.add.at(pull, member[others], favour[sighting, others])
            best = int(np.argmax(pull))
            if pull[best] > pull[member[sighting]] + 1e-9:
                member[sighting] = best
        if np.array_equal(before, member):
            break
    return [[int(k) for k in np.flatnonzero(member == g)] for g in np.unique(member)]
