"""The paper's association recipe, written plainly to judge the simulated orchard by.

Whole-cluster clouds centred on their means, point-to-point ICP from the
identity (30 mm, then 3 mm), Hungarian assignment of centroids, matches of
10 mm and more discarded (paper, "Growth Rate Tracking").
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

Points = npt.NDArray[np.float64]
GATE_MM = 10.0


def associate(first: dict[int, Points], second: dict[int, Points]) -> list[tuple[int, int]]:
    """Pairs of keys of two clusters, each a cloud (N, 3) in mm by fruitlet."""
    source = np.concatenate(list(first.values()))
    target = np.concatenate(list(second.values()))
    source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
    rotation, shift = _icp(source - source_mean, target - target_mean)
    moved = np.array([rotation @ (c.mean(axis=0) - source_mean) + shift for c in first.values()])
    fixed = np.array([c.mean(axis=0) - target_mean for c in second.values()])
    distance = np.linalg.norm(moved[:, None] - fixed[None], axis=-1)
    rows, columns = linear_sum_assignment(distance)
    keys, others = list(first), list(second)
    return [
        (keys[i], others[j]) for i, j in zip(rows, columns, strict=True) if distance[i, j] < GATE_MM
    ]


def _icp(source: Points, target: Points) -> tuple[Points, Points]:
    tree = cKDTree(target)
    rotation, shift = np.eye(3), np.zeros(3)
    for reach_mm in (30.0, 3.0):
        for _ in range(200):
            moved = source @ rotation.T + shift
            distance, nearest = tree.query(moved, distance_upper_bound=reach_mm)
            near = np.isfinite(distance)
            if near.sum() < 6:
                break
            matched = np.asarray(nearest)[near]
            turned, step = _rigid(source[near], target[matched])
            change = np.abs(turned - rotation).max() + np.abs(step - shift).max()
            rotation, shift = turned, step
            if change < 1e-5:
                break
    return rotation, shift


def _rigid(source: Points, target: Points) -> tuple[Points, Points]:
    source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((source - source_mean).T @ (target - target_mean))
    sign = np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))])
    rotation = vt.T @ sign @ u.T
    return rotation, target_mean - rotation @ source_mean
