"""Forecasts that could as well be true: sizes without their errors, other clusters drawn.

Multiple imputation (Rubin 1987) over a Bayesian bootstrap of the clusters (Rubin 1981):
every resample weighs the clusters anew, estimates the distribution of the true growth
rates with these weights, and draws a true rate for each fruitlet. A fruitlet whose fate is
not known falls as often as the others, or grows as they do. Clusters, not fruitlets, are
weighed, since those of one cluster are alike. Everything is seeded: equal sizes give
equal intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcam.growth.deconvolution import (
    distributions,
    drawn_rates,
    likelihoods,
    rate_grid,
)
from fieldcam.growth.following import FollowedFruitlet
from fieldcam.growth.noise import SizingNoise
from fieldcam.growth.reference import PERSISTS_ABOVE, weighted_means_of_fastest
from fieldcam.growth.warnings.doubts import may_be_reference
from fieldcam.values import BoolMask, Floats

RESAMPLES = 200
_SEED = 20
_FALLEN = -np.inf
_OUTSIDE = 0.1

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Resampled:
    """What may be true, once for each of the RESAMPLES."""

    set_of_tagged_pct: Floats
    """Of the clusters that were measured; only measuring errors leave it open."""
    set_of_trees_pct: Floats
    """Of all clusters like them."""
    persist_per_cluster: Floats
    """Persisting fruitlets per cluster, of all clusters like them."""
    reference_mm_per_day: float
    """Mean over the resamples of the fastest true rates."""


def resample(followed: Sequence[FollowedFruitlet], noise: SizingNoise) -> Resampled:
    """Needs at least one fruitlet with a growth rate."""
    rng = np.random.default_rng(_SEED)
    tags, cluster = np.unique([each.fruitlet.tag_id for each in followed], return_inverse=True)
    rates, stands_for = _imputed(rng, followed, _weighted(rng, len(tags))[:, cluster], noise)
    # Other weights than those of the distributions: those would count an odd cluster twice.
    clusters = _weighted(rng, len(tags))[:, cluster] * stands_for
    total = stands_for.sum(axis=1, keepdims=True)
    weights = clusters * total / clusters.sum(axis=1, keepdims=True)
    sure = _in_reference(followed)
    of_tagged = _set_shares(rates, stands_for, sure)
    of_trees = _set_shares(rates, weights, sure)
    return Resampled(
        set_of_tagged_pct=100.0 * of_tagged,
        set_of_trees_pct=100.0 * of_trees,
        persist_per_cluster=of_trees * clusters.sum(axis=1) / len(tags),
        reference_mm_per_day=round(float(_references(rates, stands_for * sure).mean()), 9),
    )


def interval90(values: Floats, forecast: float) -> Interval:
    """Between the quantiles of 5 and 95 % of (R,) values, where that holds the forecast.

    Else both quantiles are moved until it does: errors of the sizes shift a forecast, so
    that it need not be the middle of what may be true. Nine of ten values stay inside.
    """
    below, above = float((values < forecast).mean()), float((values > forecast).mean())
    first = min(below, _OUTSIDE / 2) if below < above else max(_OUTSIDE - above, _OUTSIDE / 2)
    # Ends that were drawn: a share of so many fruitlets has no values in between.
    low = np.quantile(values, first, method="lower")
    high = np.quantile(values, min(first + 1.0 - _OUTSIDE, 1.0), method="higher")
    return min(float(low), forecast), max(float(high), forecast)


def _weighted(rng: np.random.Generator, count: int) -> Floats:
    """(R, count) weights of 1 on average.

    They spread a little more than Rubin's: a mean then varies as that of a sample does,
    whose own mean had to be estimated.
    """
    return rng.dirichlet(np.full(count, max(count - 2, 1) / count), RESAMPLES) * count


def _imputed(
    rng: np.random.Generator,
    followed: Sequence[FollowedFruitlet],
    weights: Floats,
    noise: SizingNoise,
) -> tuple[Floats, Floats]:
    """(R, N) rates, minus infinity for what has fallen; and how many each one stands for.

    Late ones without a rate stand for all that were not seen at first: those of them that fell
    since never show. With a rate they stand for themselves: on a short interval slow ones have
    slowed further, which makes up for those that fell (docs/growth.md).
    """
    growth = [each.growth for each in followed if each.growth is not None]
    grid = rate_grid(growth, noise)
    likelihood = likelihoods(growth, noise, grid)
    grown = np.array([each.growth is not None for each in followed])
    fallen = np.array([each.fallen for each in followed])
    unknown = np.array([each.new for each in followed]) | ~(grown | fallen)
    late = np.array([each.late for each in followed]) & unknown
    hangs = np.array([each.hangs for each in followed]) & ~late
    distribution = distributions(likelihood, weights[:, grown])
    rates = np.full(weights.shape, _FALLEN)
    shares = weights[:, grown] / weights[:, grown].sum(axis=1, keepdims=True)
    rates[:, grown] = drawn_rates(rng, distribution, likelihood, shares, grid)
    anything = np.ones((int(unknown.sum()), grid.size), np.float32)
    none = np.zeros((len(weights), len(anything)))
    rates[:, unknown] = drawn_rates(rng, distribution, anything, none, grid)
    share_fallen = _share_fallen(followed, weights)[:, None]
    rates[(rng.random(weights.shape) < share_fallen) & unknown & ~hangs] = _FALLEN
    return rates, np.where(late, 1.0 / (1.0 - share_fallen), 1.0)


def _share_fallen(followed: Sequence[FollowedFruitlet], weights: Floats) -> Floats:
    """(R,) share of the fruitlets sized on the first of the two visits that fell since."""
    sized = np.array([each.sized_at_start for each in followed])
    fallen = _sum_where(weights, sized & np.array([each.fallen for each in followed]))
    grown = _sum_where(weights, np.array([each.growth is not None for each in followed]))
    return fallen / (fallen + grown)


def _sum_where(weights: Floats, chosen: BoolMask) -> Floats:
    return np.asarray(weights[:, chosen].sum(axis=1))


def _in_reference(followed: Sequence[FollowedFruitlet]) -> BoolMask:
    """(N,) who is not a doubtful match; all where nobody else has a rate."""
    sure = np.array([may_be_reference(each.doubts) for each in followed])
    grown = np.array([each.growth is not None for each in followed])
    return sure if (sure & grown).any() else np.ones(len(followed), np.bool_)


def _set_shares(rates: Floats, weights: Floats, in_reference: BoolMask) -> Floats:
    """(R,) share of the weight that persists by the model, the reference taken anew."""
    cutoffs = PERSISTS_ABOVE * np.maximum(_references(rates, weights * in_reference), 0.0)
    return np.asarray((weights * (rates > cutoffs[:, None])).sum(axis=1) / weights.sum(axis=1))


def _references(rates: Floats, weights: Floats) -> Floats:
    """(R,) mean rates of the fastest fruitlets; those that have fallen have no rate."""
    hanging = np.isfinite(rates)
    return weighted_means_of_fastest(np.where(hanging, rates, 0.0), np.where(hanging, weights, 0.0))
