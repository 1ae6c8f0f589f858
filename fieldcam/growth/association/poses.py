"""How one picture's cluster may lie in another's camera frame: many guesses at once.

A guess turns, spreads and shifts the first picture's points, given from their middle, onto
the second's. All arrays have the guesses first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fieldcam.growth.association.likelihood import Plausibility
from fieldcam.growth.association.points import F64, Points

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.intp]
NONE = -1
"""Instead of the index of a fruitlet that has no partner."""
STEPS = 2
"""Of Gauss and Newton; the problem is nearly linear."""
SAME_GAP_SD = 3.0
"""Two gaps between fruitlets that differ by more than so many deviations are not one gap."""
MIN_SINE = 1e-7
"""Of an angle; below it a half turn does not tell its axis."""
ANYWHERE_SD_MM = 100.0
"""Of a cluster's middle where no tag says where to expect it."""


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """Where a cluster is looked for before its fruitlets are compared."""

    rotation: F64
    """(H, 3, 3)"""
    middle_mm: F64
    """(H, 3) in the second camera's frame."""
    middle_sd_mm: float
    log_spread: float
    log_spread_sd: float
    turn_sd_rad: float

    def of(self, chosen: Ints) -> Expected:
        return Expected(
            self.rotation[chosen], self.middle_mm[chosen], self.middle_sd_mm, self.log_spread,
            self.log_spread_sd, self.turn_sd_rad,
        )  # fmt: skip

    @property
    def sd(self) -> F64:
        """(7,) of turn, middle and logarithm of the spread."""
        return np.array(
            [self.turn_sd_rad] * 3 + [self.middle_sd_mm] * 3 + [self.log_spread_sd], np.float64
        )


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Guesses, each with what it was expected to be near."""

    rotation: F64
    """(H, 3, 3)"""
    middle_mm: F64
    """(H, 3)"""
    log_spread: F64
    """(H,)"""
    expected: Expected

    def __len__(self) -> int:
        return len(self.rotation)

    def of(self, chosen: Ints) -> Poses:
        return Poses(
            self.rotation[chosen], self.middle_mm[chosen], self.log_spread[chosen],
            self.expected.of(chosen),
        )  # fmt: skip

    def arms(self, centers_mm: F64) -> F64:
        """(H, N, 3) the first picture's points as seen from the middle, turned and spread."""
        turned = np.einsum("hij,nj->hni", self.rotation, centers_mm)
        return np.asarray(turned * np.exp(self.log_spread)[:, None, None])

    def moved(self, centers_mm: F64) -> F64:
        """(H, N, 3) in the second camera's frame."""
        return self.arms(centers_mm) + self.middle_mm[:, None]

    def surprise(self) -> F64:
        """(H,) minus log of how far each is from what was expected, without constants."""
        return np.asarray(((self._off() / self.expected.sd) ** 2).sum(axis=1) / 2)

    def _off(self) -> F64:
        """(H, 7) turn, middle and logarithm of the spread against what was expected."""
        turn = turn_vectors(self.rotation @ self.expected.rotation.transpose(0, 2, 1))
        shift = self.middle_mm - self.expected.middle_mm
        spread = self.log_spread - self.expected.log_spread
        return np.concatenate([turn, shift, spread[:, None]], axis=1)

    def fitted(self, source: F64, target: F64, matched: Bools, sd_mm: float) -> tuple[Poses, F64]:
        """Most likely poses for points (N, 3) matched with others (H, N, 3), and (H,) the log of
        the share of what was expected that fits as well (Laplace's approximation)."""
        poses = self
        for _ in range(STEPS):
            poses, precision = poses._step(source, target, matched, sd_mm)
        return poses, -np.linalg.slogdet(precision)[1] / 2 - np.log(self.expected.sd).sum()

    def precision(self, source: F64, matched: Bools, sd_mm: float) -> F64:
        """(H, 7, 7) how firmly the matched points hold turn, middle and spread."""
        return self._held(self._jacobian(source, matched), sd_mm)

    def _held(self, jacobian: F64, sd_mm: float) -> F64:
        flat = jacobian.reshape(len(self), -1, jacobian.shape[-1])
        held = flat.transpose(0, 2, 1) @ flat / sd_mm**2
        return np.asarray(held + np.diag(self.expected.sd**-2))

    def _jacobian(self, source: F64, matched: Bools) -> F64:
        """(H, N, 3, 7) of places by turn, middle and logarithm of the spread."""
        arm = self.arms(source)
        still = np.broadcast_to(np.eye(3), (*arm.shape, 3))
        full = np.concatenate([-_cross(arm), still, arm[..., None]], axis=-1)
        return np.asarray(full * matched[..., None, None])

    def _step(self, source: F64, target: F64, matched: Bools, sd_mm: float) -> tuple[Poses, F64]:
        gap = (target - self.moved(source)) * matched[..., None]
        jacobian = self._jacobian(source, matched)
        pull = np.einsum("hnki,hnk->hi", jacobian, gap) / sd_mm**2
        pull -= self._off() / self.expected.sd**2
        precision = self._held(jacobian, sd_mm)
        step = np.linalg.solve(precision, pull[..., None])[..., 0]
        rotation = Rotation.from_rotvec(step[:, :3]).as_matrix() @ self.rotation
        fitted = Poses(
            rotation, self.middle_mm + step[:, 3:6], self.log_spread + step[:, 6], self.expected
        )
        return fitted, precision


def turn_vectors(rotation: F64) -> F64:
    """(H, 3) axis times angle, rad, of rotations (H, 3, 3).

    SciPy's own makes sure of each that it is one, which took a third of an association's time.
    """
    k, m, n = (1, 2, 0), (2, 0, 1), (0, 1, 2)
    axis = (rotation[:, m, k] - rotation[:, k, m]) / 2
    sine = np.linalg.norm(axis, axis=1)
    cosine = (rotation[:, n, n].sum(axis=1) - 1) / 2
    found = axis * (np.arctan2(sine, cosine) / np.maximum(sine, MIN_SINE))[:, None]
    half = (sine < MIN_SINE) & (cosine < 0)
    if half.any():
        found[half] = Rotation.from_matrix(rotation[half]).as_rotvec()
    return np.asarray(found)


def expected_poses(first: Points, second: Points, days: float, p: Plausibility) -> Poses:
    """Where the cluster is expected: as the camera stood before, or as its tag turned."""
    middle = first.centers_mm.mean(axis=0)
    rotations = _expected_rotations(first, second)
    if first.tag_mm is not None and second.tag_mm is not None:
        middles = [second.tag_mm + r @ (middle - first.tag_mm) for r in rotations]
        sd_mm = p.swing_sd_mm
    else:
        known = second.centers_mm if second.seen else first.centers_mm
        middles = [known.mean(axis=0) for _ in rotations]
        sd_mm = ANYWHERE_SD_MM
    spread = p.spread_per_day * days
    expected = Expected(
        np.array(rotations), np.array(middles), sd_mm, spread, p.spread_sd(days), p.turn_sd_rad
    )
    return Poses(expected.rotation, expected.middle_mm, np.full(len(rotations), spread), expected)


def first_guesses(first: Points, second: Points, days: float, p: Plausibility) -> Poses:
    """From what is expected alone, from one pair of fruitlets, and from two."""
    start = expected_poses(first, second, days, p)
    b = second.centers_mm
    source, rotations, middles = [], [], []
    for k, arms in enumerate(start.arms(first.centers_mm - first.centers_mm.mean(axis=0))):
        one = (b[None] - arms[:, None]).reshape(-1, 3)
        turns, shifts = _from_two(arms, b, SAME_GAP_SD * p.place_sd_mm(days))
        still = np.broadcast_to(start.rotation[k], (len(one) + 1, 3, 3))
        rotations += [still, turns @ start.rotation[k]]
        middles += [start.middle_mm[k][None], one, shifts]
        source += [k] * (len(still) + len(turns))
    known = start.of(np.array(source))
    return Poses(
        np.concatenate(rotations), np.concatenate(middles), known.log_spread, known.expected
    )


def _expected_rotations(first: Points, second: Points) -> list[F64]:
    """The operator stands as before; or the cluster turned with its tag."""
    found: list[F64] = [np.eye(3)]
    if first.tag_rotation is not None and second.tag_rotation is not None:
        found.append(second.tag_rotation @ first.tag_rotation.T)
    return found


def _from_two(arms: F64, b: F64, slack_mm: float) -> tuple[F64, F64]:
    """Least further turns that lay a gap between two fruitlets along one of the others'."""
    i, k = np.nonzero(~np.eye(len(arms), dtype=bool))
    j, m = np.nonzero(~np.eye(len(b), dtype=bool))
    before, after = arms[k] - arms[i], b[m] - b[j]
    lengths = np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1)
    one, other = np.nonzero(np.abs(lengths[0][:, None] - lengths[1][None]) < slack_mm)
    turns = _least_turns(before[one], after[other])
    halfway = (arms[i] + arms[k])[one] / 2
    return turns, (b[j] + b[m])[other] / 2 - np.einsum("hij,hj->hi", turns, halfway)


def _least_turns(source: F64, target: F64) -> F64:
    """Rotations (H, 3, 3) by the least angle that take directions (H, 3) to others."""
    u = source / np.maximum(np.linalg.norm(source, axis=1, keepdims=True), 1e-9)
    v = target / np.maximum(np.linalg.norm(target, axis=1, keepdims=True), 1e-9)
    axis = np.cross(u, v)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.arctan2(sine[:, 0], (u * v).sum(axis=1))
    return Rotation.from_rotvec(axis / np.maximum(sine, 1e-9) * angle[:, None]).as_matrix()


def _cross(vectors: F64) -> F64:
    """Matrices (..., 3, 3) whose product with w is the cross product with w."""
    return np.asarray(vectors @ _CROSS).reshape(*vectors.shape[:-1], 3, 3)


_CROSS = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0],
                   [0, -1, 0, 1, 0, 0, 0, 0, 0]], np.float64)  # fmt: skip
