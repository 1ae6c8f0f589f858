"""Association by what moves and grows: every way to lay one cluster on the other is weighed.

Guesses at the pose (none, one or two pairs of fruitlets; the camera's or the tag's turn as
a prior) each get their best one-to-one matches, in which a fruitlet may stay unmatched, and
then their best pose. The answer is not the best guess but the share of all guesses'
likelihood in which two fruitlets are one: a match with its confidence.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import softmax

from fieldcam.growth.association.likelihood import Plausibility
from fieldcam.growth.association.points import F64, Points
from fieldcam.growth.association.poses import NONE, Ints, Poses, first_guesses

KEPT_GUESSES = 40
ROUNDS = 3
VARIED = 4
"""How many of the best ways are tried with two matches exchanged or one left out."""


def match_by_geometry(
    first: Points, second: Points, days: float, plausibility: Plausibility | None = None
) -> F64:
    """Certainty (N, M), 0 to 1, that two fruitlets are the same; `days` lie between."""
    p = plausibility or Plausibility()
    certainty = np.zeros((len(first.seen), len(second.seen)))
    if not certainty.size:
        return certainty
    ways = _Ways(first, second, days, p)
    matches, weights = ways.weighed()
    for match, weight in zip(matches, weights, strict=True):
        known = np.flatnonzero(match != NONE)
        certainty[known, match[known]] += weight
    return certainty


class _Ways:
    """All ways to match two pictures' fruitlets that are worth a look."""

    def __init__(self, first: Points, second: Points, days: float, p: Plausibility) -> None:
        self._a = first.centers_mm - first.centers_mm.mean(axis=0)
        self._b = second.centers_mm
        self._of_sizes = p.size_log_odds(first, second, days)
        self._days, self._p = days, p
        self._guesses = first_guesses(first, second, days, p)

    def weighed(self) -> tuple[Ints, F64]:
        """Matches (H, N), NONE for an unmatched fruitlet, and their share of the likelihood."""
        poses = self._promising(self._guesses)
        for _ in range(ROUNDS):
            matches = self._best_matches(poses)
            matches, chosen = np.unique(matches, axis=0, return_index=True)
            poses, log_likelihood = self._fit(poses.of(chosen), matches)
        best = np.argsort(-log_likelihood)[:VARIED]
        variants = self._variants(matches, best)
        source = np.concatenate([np.full(len(v), k) for k, v in variants])
        more = np.concatenate([v for _, v in variants])
        _, likely = self._fit(poses.of(source), more)
        everything, chosen = np.unique(np.concatenate([matches, more]), axis=0, return_index=True)
        return everything, softmax(np.concatenate([log_likelihood, likely])[chosen])

    def _odds(self, poses: Poses) -> F64:
        """(H, N, M)"""
        gaps = poses.moved(self._a)[:, :, None] - self._b[None, None]
        return self._p.place_log_odds(gaps, self._days) + self._of_sizes

    def _promising(self, poses: Poses) -> Poses:
        odds = np.maximum(self._odds(poses), 0)
        either = np.minimum(odds.max(axis=2).sum(axis=1), odds.max(axis=1).sum(axis=1))
        return poses.of(np.argsort(poses.surprise() - either)[:KEPT_GUESSES])

    def _best_matches(self, poses: Poses) -> Ints:
        found = np.full((len(poses), len(self._a)), NONE, np.intp)
        for row, odds in zip(found, np.maximum(self._odds(poses), 0), strict=True):
            one, other = linear_sum_assignment(odds, maximize=True)
            row[one] = np.where(odds[one, other] > 0, other, NONE)
        return found

    def _fit(self, poses: Poses, matches: Ints) -> tuple[Poses, F64]:
        """The best pose for each way to match, and the log of its likelihood (H,)."""
        matched = matches != NONE
        sd_mm = self._p.place_sd_mm(self._days)
        poses, log_width = poses.fitted(self._a, self._b[matches], matched, sd_mm)
        odds = np.take_along_axis(self._odds(poses), matches[..., None].clip(0), axis=2)[..., 0]
        return poses, (odds * matched).sum(axis=1) - poses.surprise() + log_width

    @staticmethod
    def _variants(matches: Ints, best: Ints) -> list[tuple[int, Ints]]:
        """For some ways: each with two of its partners exchanged, or one left out."""
        found = []
        for k in best:
            way = matches[k]
            count = len(way)
            varied = [way.copy()]
            for i in range(count):
                alone = way.copy()
                alone[i] = NONE
                varied.append(alone)
                for j in range(i):
                    swapped = way.copy()
                    swapped[[i, j]] = way[[j, i]]
                    varied.append(swapped)
            found.append((int(k), np.array(varied)))
        return found
