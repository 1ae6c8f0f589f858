"""Where a fruitlet of one picture ought to be in another one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcam.growth.association.likelihood import Plausibility
from fieldcam.growth.association.points import F64, Points
from fieldcam.growth.association.poses import NONE, Ints, expected_poses


@dataclass(frozen=True, slots=True, eq=False)
class Whereabouts:
    """Where a fruitlet's middle is expected."""

    center_mm: F64
    """(3,) in the camera frame of the picture that is looked at."""
    sd_mm: float
    """Along each axis."""


def whereabouts(
    first: Points, second: Points, partner: Ints, days: float, wanted: Sequence[int]
) -> list[Whereabouts]:
    """The places in `second` of some fruitlets of `first`.

    `partner` (N,) gives each fruitlet's index in `second`, NONE for one that has none.
    """
    p = Plausibility()
    middle = first.centers_mm.mean(axis=0)
    poses = expected_poses(first, second, days, p)
    matches = np.broadcast_to(partner, (len(poses), len(partner)))
    target = second.centers_mm[matches.clip(0)] if second.seen else np.zeros((*matches.shape, 3))
    sd_mm = p.place_sd_mm(days)
    fitted, log_width = poses.fitted(first.centers_mm - middle, target, matches != NONE, sd_mm)
    arms = fitted.moved(first.centers_mm - middle)
    gaps = np.where((matches != NONE)[..., None], target - arms, 0.0)
    likely = log_width - fitted.surprise() - (gaps**2).sum(axis=(1, 2)) / (2 * sd_mm**2)
    best = fitted.of(np.array([np.argmax(likely)]))
    arm = best.arms(first.centers_mm - middle)[0]
    precision = best.precision(first.centers_mm - middle, matches[:1] != NONE, sd_mm)[0]
    spread = np.linalg.inv(precision)
    return [
        Whereabouts(arm[k] + best.middle_mm[0], float(np.hypot(sd_mm, _loose_mm(arm[k], spread))))
        for k in wanted
    ]


def _loose_mm(arm: F64, spread: F64) -> float:
    """Standard deviation along an axis that an uncertain pose gives to a point."""
    x, y, z = arm
    turn = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    jacobian = np.concatenate([turn, np.eye(3), arm[:, None]], axis=1)
    return float(np.sqrt(np.trace(jacobian @ spread @ jacobian.T) / 3))
