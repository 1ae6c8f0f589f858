"""The paper's association: whole-cluster ICP, coarse then fine, then the Hungarian algorithm.

As re-coded by its authors for a later comparison: clouds centred on their own means
and thinned to 1 mm, point-to-point ICP from the identity (30 mm, then 3 mm), matches
of 10 mm and more discarded.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from fieldcam.growth.association.points import F64, Points
from fieldcam.growth.association.rigid import rigid

GATE_MM = 10.0
REACHES_MM = (30.0, 3.0)
ITERATIONS = 2000
STILL = 1e-6
"""A step that changes rotation (rad) and shift (mm) by less than this is the last."""
FEWEST_POINTS = 3


def match_by_paper(first: Points, second: Points) -> F64:
    """Certainty (N, M) that two fruitlets are the same: 1 for a match, else 0."""
    certainty = np.zeros((len(first.seen), len(second.seen)))
    clouds = [[np.asarray(s.cloud_mm, np.float64) for s in p.seen] for p in (first, second)]
    if not all(len(cloud) for side in clouds for cloud in side) or not certainty.size:
        clouds = [[np.asarray([s.center_mm]) for s in p.seen] for p in (first, second)]
    if not certainty.size:
        return certainty
    source, target = (np.concatenate(side) for side in clouds)
    source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
    rotation, shift = _icp(source - source_mean, target - target_mean)
    moved = np.array([c.mean(axis=0) - source_mean for c in clouds[0]]) @ rotation.T + shift
    fixed = np.array([c.mean(axis=0) - target_mean for c in clouds[1]])
    distance = np.linalg.norm(moved[:, None] - fixed[None], axis=-1)
    for i, j in zip(*linear_sum_assignment(distance), strict=True):
        certainty[i, j] = float(distance[i, j] < GATE_MM)
    return certainty


def _icp(source: F64, target: F64) -> tuple[F64, F64]:
    """Rotation (3, 3) and shift (3,) that lay one cloud on the other."""
    tree = cKDTree(target)
    rotation, shift = np.eye(3), np.zeros(3)
    for reach_mm in REACHES_MM:
        for _ in range(ITERATIONS):
            distance, nearest = tree.query(source @ rotation.T + shift)
            near = np.asarray(distance < reach_mm)
            if near.sum() < FEWEST_POINTS:
                break
            turned, step = rigid(source[near], target[np.asarray(nearest)[near]])
            change = max(np.abs(turned - rotation).max(), np.abs(step - shift).max())
            rotation, shift = turned, step
            if change < STILL:
                break
    return rotation, shift
