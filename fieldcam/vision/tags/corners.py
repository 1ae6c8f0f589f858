"""Corners of a tag to a fraction of a pixel, from the grey levels along its edges.

The detector fits lines through whole-pixel edges, so that a tag hanging upright
comes out up to half a pixel too large or too small on every side, which is up to
1 % of its range.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import FloatMap, ImageU8

Array = npt.NDArray[np.float64]

REACH_PX = 3.0
"""How far from the coarse edge the true one is looked for, on both sides."""

SMALLEST_SIDE_PX = 16 * REACH_PX
"""Below it the reach spans more than half of the border's width, an eighth of the side."""

STEP_PX = 0.25
PASSES = 2
"""The second one starts from a centred window, where the first one's bias is gone."""

MARGIN = 0.12
"""Share of an edge left out at each end, where the other edges bend the gradient."""


def refine_corners(grey: ImageU8, corners_px: Array) -> Array:
    """(4, 2) corners as crossings of the edges' sub-pixel lines.

    `grey` is (H, W). Small tags keep their corners, and so does a tag whose
    edges cannot be followed, as at the image border.
    """
    if _sides_px(corners_px).min() < SMALLEST_SIDE_PX:
        return corners_px
    patch, origin = _patch(grey, corners_px)
    refined = corners_px - origin
    for _ in range(PASSES):
        lines = [_edge_line(patch, refined[i], refined[(i + 1) % 4]) for i in range(4)]
        crossings = np.array([np.cross(lines[i - 1], lines[i]) for i in range(4)])
        if not (np.isfinite(crossings).all() and (crossings[:, 2] != 0).all()):
            return corners_px
        refined = crossings[:, :2] / crossings[:, 2:]
    moved_px = np.linalg.norm(refined + origin - corners_px, axis=1)
    return refined + origin if moved_px.max() < REACH_PX else corners_px


def _patch(grey: ImageU8, corners_px: Array) -> tuple[FloatMap, Array]:
    """The tag's surroundings as float32, and where in the image they begin."""
    reach = int(2 * REACH_PX) + 1
    x0, y0 = np.maximum(np.floor(corners_px.min(axis=0)).astype(int) - reach, 0)
    x1, y1 = np.ceil(corners_px.max(axis=0)).astype(int) + reach
    return grey[y0:y1, x0:x1].astype(np.float32), np.array([x0, y0], np.float64)


def _sides_px(corners_px: Array) -> Array:
    return np.asarray(np.linalg.norm(corners_px - np.roll(corners_px, 1, axis=0), axis=1))


def _edge_line(patch: FloatMap, start: Array, end: Array) -> Array:
    """Homogeneous line (3,) of one black-to-white edge; NaN where there is none."""
    length_px = float(np.linalg.norm(end - start))
    along = (end - start) / length_px
    outward = np.array([-along[1], along[0]])
    shares = np.linspace(MARGIN, 1 - MARGIN, max(8, int(length_px)))
    offsets_px = np.arange(-REACH_PX, REACH_PX + STEP_PX, STEP_PX)
    bases = start + shares[:, None] * (end - start)
    points = bases[:, None, :] + offsets_px[:, None] * outward
    rise = np.diff(_sample(patch, points), axis=1).clip(min=0)
    strength = rise.sum(axis=1)
    with np.errstate(invalid="ignore"):
        edge_px = (rise * (offsets_px[:-1] + STEP_PX / 2)).sum(axis=1) / strength
    return _fit_line(bases + edge_px[:, None] * outward, strength)


def _sample(patch: FloatMap, points: Array) -> Array:
    columns, rows = (np.ascontiguousarray(points[..., i], np.float32) for i in range(2))
    sampled = cv2.remap(patch, columns, rows, cv2.INTER_LINEAR)
    return np.asarray(sampled, np.float64)


def _fit_line(points: Array, strength: Array) -> Array:
    """Through the points with a clear edge, the farthest fifth left out."""
    clear = strength > np.median(strength) / 2
    if clear.sum() < 4:
        return np.full(3, np.nan)
    line = _total_least_squares(points[clear])
    distances = np.abs(points[clear] @ line[:2] + line[2])
    return _total_least_squares(points[clear][distances <= np.quantile(distances, 0.8)])


def _total_least_squares(points: Array) -> Array:
    center = points.mean(axis=0)
    normal = np.linalg.svd(points - center, full_matrices=False)[2][1]
    return np.array([normal[0], normal[1], -normal @ center])
