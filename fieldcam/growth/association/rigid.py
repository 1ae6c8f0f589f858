"""The rotation and shift that lay one set of points on another."""

from __future__ import annotations

import numpy as np

from fieldcam.growth.association.points import F64


def rigid(source: F64, target: F64) -> tuple[F64, F64]:
    """Least-squares rotation (3, 3) and shift (3,) from paired points (N, 3) (Kabsch)."""
    source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((source - source_mean).T @ (target - target_mean))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))])
    rotation = vt.T @ sign @ u.T
    return rotation, target_mean - rotation @ source_mean
