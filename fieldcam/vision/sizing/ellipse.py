"""Robust ellipse through part of an outline, with an honest uncertainty.

The ellipse is the set of p with |L (p - c)| = 1, L symmetric. Its five numbers
are fitted by Gauss-Newton on first-order geometric distances, reweighted so
that stray points lose their say. Fruitlets are slightly prolate, which enters
as a weak prior on the shape; the network's guess of the hidden arc enters with
a low weight. Both matter only where the visible arc is short.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldcam.values import BoolMask, Ellipse

Vectors = npt.NDArray[np.float64]
ROUNDS = 15
STILL = 1e-4
"""A step this small, in units of the outline's size, ends the fit."""
REACH = 3.0
"""Standard deviations at which a point has lost three quarters of its say (Geman-McClure)."""
SECTORS = 36


@dataclass(frozen=True, slots=True)
class FitParameters:
    """How far the parts of an outline are trusted."""

    edge_sd_px: float = 0.2
    hidden_sd_share: float = 0.05
    """Of the width: how far off the network's guess of a hidden arc may be."""
    correlation_px: float = 8.0
    """Outline points closer than this share their error."""
    shape_sd: float = 0.05
    """Of (major - minor) / (major + minor)."""


@dataclass(frozen=True, slots=True, eq=False)
class EllipseFit:
    """An ellipse and how well the outline holds it."""

    center_px: tuple[float, float]
    shape: Vectors
    """(2, 2) L, 1/px."""
    minor_sd_px: float
    """Standard deviation of the short axis' full length."""
    residual_px: float
    """Robust spread of the edge points around the ellipse."""
    coverage: float
    """Share of the circumference that has edge points on it."""

    @property
    def ellipse(self) -> Ellipse:
        return to_ellipse(self.center_px, self.shape)

    def radius_at(self, points: Vectors) -> Vectors:
        """Distance of points (N, 2) from the centre in units of the ellipse's radius there."""
        return np.asarray(np.linalg.norm((points - self.center_px) @ self.shape, axis=1))


def to_ellipse(center_px: tuple[float, float], shape: Vectors) -> Ellipse:
    """Axes and angle of the ellipse |L (p - c)| = 1, L (2, 2) in 1/px."""
    values, axes = np.linalg.eigh(shape)
    angle = float(np.arctan2(axes[1, 0], axes[0, 0]))
    return Ellipse(center_px, 2.0 / float(values[0]), 2.0 / float(values[1]), angle)


def fit_ellipse(
    edge: Vectors, hidden: Vectors, parameters: FitParameters | None = None
) -> EllipseFit | None:
    """Fit edge points (N, 2) and, with low weight, hidden-arc points (M, 2); None if degenerate."""
    parameters = parameters or FitParameters()
    points = np.concatenate([edge, hidden])
    if len(edge) < 6:
        return None
    origin = points.mean(axis=0)
    size = float(np.sqrt(((points - origin) ** 2).sum(axis=1).mean()))
    if size < 1.0:
        return None
    problem = _Problem.build((points - origin) / size, len(edge), size, parameters)
    state = problem.solve()
    if state is None:
        return None
    center = state[:2] * size + origin
    shape = _matrix(state) / size
    residual = problem.spread(state)
    return EllipseFit(
        (float(center[0]), float(center[1])),
        shape,
        problem.minor_sd(state, residual) * size,
        residual * size,
        _coverage(edge, center, shape, max(3 * residual * size, 1.5)),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """One fit in units of the outline's own size."""

    points: Vectors
    is_edge: BoolMask
    sd: Vectors
    """(N,) of each point's distance to the ellipse."""
    share: Vectors
    """(N,) independent observations that one point is worth."""
    shape_sd: float

    @classmethod
    def build(cls, points: Vectors, edges: int, size: float, parameters: FitParameters) -> _Problem:
        is_edge = np.arange(len(points)) < edges
        hidden_sd = max(parameters.hidden_sd_share * 2, parameters.edge_sd_px / size)
        return cls(
            points,
            is_edge,
            np.where(is_edge, parameters.edge_sd_px / size, hidden_sd),
            # A zero line has 4 / pi crossings to the pixel on average.
            np.full(len(points), np.pi / 4 / parameters.correlation_px),
            parameters.shape_sd,
        )

    def solve(self) -> Vectors | None:
        state = self._start()
        for k in range(ROUNDS):
            # Wide at first, so that a poor start can still be pulled over.
            widen = max(1.0, 8.0 * 0.4**k)
            distance, jacobian = _distances(self.points, state)
            normal, gradient = self._normal(state, distance, jacobian, self.sd * widen)
            step = np.linalg.solve(normal, -gradient)
            state = state + step * min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-12))
            if not _plausible(state):
                return None
            if widen == 1.0 and float(np.abs(step).max()) < STILL:
                break
        return state

    def spread(self, state: Vectors) -> float:
        """Robust standard deviation of the edge points' distances; `state` is (5,)."""
        distance, _ = _distances(self.points[self.is_edge], state)
        return float(1.4826 * np.median(np.abs(distance)))

    def minor_sd(self, state: Vectors, spread: float) -> float:
        distance, jacobian = _distances(self.points, state)
        sd = np.where(self.is_edge, np.maximum(self.sd, spread), self.sd)
        normal, _ = self._normal(state, distance, jacobian, sd)
        values, axes = np.linalg.eigh(_matrix(state))
        v = axes[:, 1]
        slope = np.array([0.0, 0.0, v[0] ** 2, 2 * v[0] * v[1], v[1] ** 2])
        slope *= 2 / values[1] ** 2
        return float(np.sqrt(slope @ np.linalg.solve(normal, slope)))

    def _normal(
        self, state: Vectors, distance: Vectors, jacobian: Vectors, sd: Vectors
    ) -> tuple[Vectors, Vectors]:
        """Normal matrix (5, 5) and gradient (5,) of the weighted squares."""
        weight = self.share / sd**2 / (1.0 + (distance / (REACH * sd)) ** 2) ** 2
        normal = (jacobian * weight[:, None]).T @ jacobian
        gradient = jacobian.T @ (weight * distance)
        mean = (state[2] + state[4]) / 2
        for row in (np.array([0, 0, 0.5, 0, -0.5]), np.array([0, 0, 0, 1.0, 0])):
            row = row / (mean * self.shape_sd)
            normal += np.outer(row, row)
            gradient += row * (row @ state)
        return normal + np.eye(5) * 1e-9, gradient

    def _start(self) -> Vectors:
        """The circle through all points in the least-squares sense (Kåsa)."""
        design = np.column_stack([self.points, np.ones(len(self.points))])
        weight = np.sqrt(np.where(self.is_edge, 1.0, 0.5))[:, None]
        target = (self.points**2).sum(axis=1)
        solved = np.linalg.lstsq(design * weight, target * weight[:, 0], rcond=None)[0]
        center = np.clip(solved[:2] / 2, -1.5, 1.5)
        radius = np.sqrt(np.clip(solved[2] + center @ center, 0.25, 4.0))
        return np.array([center[0], center[1], 1 / radius, 0.0, 1 / radius])


def _distances(points: Vectors, state: Vectors) -> tuple[Vectors, Vectors]:
    """First-order distances (N,) to the ellipse, outside positive, and their Jacobian (N, 5)."""
    shape = _matrix(state)
    offset = points - state[:2]
    mapped = offset @ shape
    radius = np.maximum(np.linalg.norm(mapped, axis=1), 1e-9)
    unit = mapped / radius[:, None]
    normal = unit @ shape
    steep = np.maximum(np.linalg.norm(normal, axis=1), 1e-9)
    jacobian = np.column_stack(
        [
            -normal,
            unit[:, 0] * offset[:, 0],
            unit[:, 0] * offset[:, 1] + unit[:, 1] * offset[:, 0],
            unit[:, 1] * offset[:, 1],
        ]
    )
    return (radius - 1) / steep, jacobian / steep[:, None]


def _matrix(state: Vectors) -> Vectors:
    return np.array([[state[2], state[3]], [state[3], state[4]]])


def _plausible(state: Vectors) -> bool:
    """Whether both eigenvalues of the matrix are positive and of a sane size."""
    a, b, d = (float(v) for v in state[2:])
    if not math.isfinite(a + b + d + float(state[0]) + float(state[1])):
        return False
    middle, half = (a + d) / 2, math.hypot((a - d) / 2, b)
    return middle - half > 0.05 and middle + half < 50.0


def _coverage(edge: Vectors, center: Vectors, shape: Vectors, tolerance_px: float) -> float:
    mapped = (edge - center) @ shape
    radius = np.linalg.norm(mapped, axis=1)
    on_it = np.abs(radius - 1) <= tolerance_px * float(np.linalg.eigvalsh(shape)[1])
    angle = np.arctan2(mapped[on_it, 1], mapped[on_it, 0])
    sectors = np.floor((angle + np.pi) / (2 * np.pi) * SECTORS).astype(int) % SECTORS
    return len(np.unique(sectors)) / SECTORS
