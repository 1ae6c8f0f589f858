"""True growth rates behind measured ones, whose sizing errors are known in distribution.

The distribution of the true rates is estimated by expectation maximisation on a grid,
stopped early so that it stays smooth (Laird 1978; early stopping as in Vardi and Lee 1993),
and rates are drawn from what it and a fruitlet's own measurement say together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fieldcam.growth.grown import Growth
from fieldcam.growth.noise import SizingNoise
from fieldcam.values import Floats

EM_STEPS = 15
FEWEST_RATES, MAX_RATES = 24, 96
"""Of the grid, whose step else is half the typical error of a rate."""
_CHUNK = 8
MIN_SD_MM = 0.01
"""Whatever is said of two sizes, their difference is not known better."""
_LEAST = np.float32(1e-30)
F32 = npt.NDArray[np.float32]
"""What is drawn is far less certain than its last digits, and takes half the time."""


def rate_grid(growth: Sequence[Growth], noise: SizingNoise) -> Floats:
    """(G,) true rates that are thought possible, evenly spaced, mm/day."""
    rates = np.array([each.rate_mm_per_day for each in growth])
    sds, shares = _errors(growth, noise)
    steps = int(np.clip(2.0 * np.ptp(rates) / np.median(sds @ shares), FEWEST_RATES, MAX_RATES))
    return np.linspace(rates.min(), rates.max(), steps)


def likelihoods(growth: Sequence[Growth], noise: SizingNoise, grid: Floats) -> F32:
    """(N, G): how likely each measured rate is for each true rate, 1 for the likeliest."""
    off = np.array([each.rate_mm_per_day for each in growth])[:, None] - grid
    sds, shares = _errors(growth, noise)
    total = np.zeros(off.shape)
    for sd, share in zip(sds.T[:, :, None], shares, strict=True):
        total += share / sd * np.exp(-0.5 * (off / sd) ** 2)
    relative = total / total.max(axis=1, keepdims=True)
    return np.asarray(np.maximum(relative, _LEAST), np.float32)


def _errors(growth: Sequence[Growth], noise: SizingNoise) -> tuple[Floats, Floats]:
    """(N, P) standard deviations of rates, mm/day, and (P,) the share of each part of a mixture.

    Of sizes that say their own errors all parts are alike.
    """
    shares = np.array(noise.shares)
    before = noise.of(np.array([each.start_mm for each in growth]))
    after = noise.of(np.array([each.end_mm for each in growth]))
    fitted = np.hypot(before[:, :, None], after[:, None, :]).reshape(len(growth), -1)
    own = np.array([[np.nan if each.sd_mm is None else each.sd_mm] for each in growth])
    sds = np.where(np.isnan(own), fitted, np.maximum(own, MIN_SD_MM))
    days = np.array([[each.days] for each in growth])
    return sds / days, np.outer(shares, shares).ravel()


def distributions(likelihood: F32, weights: Floats) -> F32:
    """(R, G) distributions of the true rates for R weightings (R, N) of the fruitlets."""
    weight, steps = weights.astype(np.float32), likelihood.shape[1]
    found = np.full((len(weight), steps), 1.0 / steps, np.float32)
    for _ in range(EM_STEPS):
        found *= (weight / (found @ likelihood.T)) @ likelihood
        found /= found.sum(axis=1, keepdims=True)
    return found


def drawn_rates(
    rng: np.random.Generator,
    distribution: F32,
    likelihood: F32,
    shares: Floats,
    grid: Floats,
) -> Floats:
    """(R, N) true rates, one draw for each distribution (R, G) and fruitlet (N, G).

    `shares` (R, N) are those of the weight that made the distribution. What a fruitlet put
    into it is taken out again: its own error would vouch for itself.
    """
    share = shares.astype(np.float32)
    return np.concatenate(
        [
            _drawn(rng, distribution[part, None, :], likelihood, share[part, :, None], grid)
            for part in (slice(at, at + _CHUNK) for at in range(0, len(distribution), _CHUNK))
        ]
    )


def _drawn(
    rng: np.random.Generator, distribution: F32, likelihood: F32, shares: F32, grid: Floats
) -> Floats:
    """(R, N) rates; between the grid's points all are as likely."""
    own = distribution * likelihood
    own *= shares / own.sum(axis=2, keepdims=True)
    rising = np.cumsum(np.maximum(distribution - own, _LEAST) * likelihood, axis=2)
    drawn = rng.random(rising.shape[:2]) * rising[:, :, -1]
    places = (rising < drawn[:, :, None]).sum(axis=2)
    step = grid[1] - grid[0]
    return np.asarray(grid[places] + step * (rng.random(places.shape) - 0.5))
