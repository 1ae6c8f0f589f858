"""The outline of a fruitlet, and which part of it is really the fruitlet's edge.

A visible mask ends where the fruitlet ends, or where a leaf, a stem or another
fruitlet begins. Only the first kind of edge may enter a fit. Points are x, y in
image pixels, pixel centres at integers.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import BoolMask, FloatMap, Instance, Mask, Region

Vectors = npt.NDArray[np.float64]
MIN_PIECE_SHARE = 0.05
"""Smaller pieces of a mask are specks, not the far side of an occluder."""
INSIDE_PX = 1.0
INSIDE_SHARE = 0.03
"""An edge deeper than this (px, plus share of the width) inside the silhouette is a cover's."""
PROBES_PX = (1.5, 3.0, 4.5)
"""How far outwards to look for something in front."""
MARGIN_PX = 6
CORNER_PX = 3.0
"""Where an edge and a cover meet, this much of the edge is not trusted either."""


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """Points along the zero line of a visible mask."""

    points_px: Vectors
    """(N, 2)."""
    outward: Vectors
    """(N, 2) unit vectors from the fruitlet outwards."""


@dataclass(frozen=True, slots=True, eq=False)
class Cover:
    """What lies in front of a fruitlet."""

    region: Region
    blocked: BoolMask
    """(region.height, region.width): pixels of something nearer."""


def pixel_outline(mask: Mask) -> Vectors:
    """The paper's outline: pixel centres (N, 2) along the border of the largest piece."""
    contours, _ = cv2.findContours(
        mask.window.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    if not contours:
        return np.zeros((0, 2))
    largest = max(contours, key=cv2.contourArea)
    return np.asarray(largest.reshape(-1, 2) + np.array([mask.x0, mask.y0]), dtype=np.float64)


def zero_outline(logits: FloatMap, x0: int, y0: int) -> Outline:
    """Where logits (h, w) cross zero between neighbouring pixels, by linear interpolation."""
    values = without_specks(logits)
    down, across = (np.asarray(g, dtype=np.float64) for g in np.gradient(values))
    found = []
    for axis in (0, 1):
        first, second = _neighbours(values, axis)
        at = np.nonzero((first > 0) != (second > 0))
        part = first[at] / (first[at] - second[at])
        step = np.zeros((len(part), 2))
        step[:, 1 - axis] = part
        points = np.stack([at[1], at[0]], axis=1) + step
        slope = np.stack([_between(g, axis, at, part) for g in (across, down)], axis=1)
        found.append((points, -slope))
    points = np.concatenate([p for p, _ in found]) + np.array([x0, y0])
    outward = np.concatenate([o for _, o in found])
    length = np.linalg.norm(outward, axis=1, keepdims=True)
    return Outline(points, outward / np.maximum(length, 1e-9))


def without_specks(logits: FloatMap) -> Vectors:
    """Logits (h, w) with all but the mask's substantial pieces made negative."""
    values = logits.astype(np.float64)
    values[values == 0] = -1e-6
    count, labels = cv2.connectedComponents((values > 0).astype(np.uint8), connectivity=4)
    if count <= 2:
        return values
    areas = np.bincount(labels.ravel(), minlength=count)
    specks = np.flatnonzero(areas < MIN_PIECE_SHARE * areas[1:].sum())
    return np.where(np.isin(labels, specks) & (labels > 0), -np.abs(values), values)


def true_edge(
    outline: Outline, instance: Instance, cover: Cover | None, silhouette: FloatMap | None
) -> BoolMask:
    """Which outline points (N,) are the fruitlet's own edge.

    Three cues tell an edge made by a cover: it runs inside the whole
    silhouette (logits over the mask's window), inside the convex hull of the
    visible part, or has something nearer just outside.
    """
    width = 2 * np.sqrt(instance.visible.area_px / np.pi)
    tolerance = INSIDE_PX + INSIDE_SHARE * width
    own = _depth_in_hull(outline.points_px) <= tolerance
    if silhouette is not None:
        mask = instance.visible
        own &= _depth_in(silhouette, outline.points_px - (mask.x0, mask.y0)) <= tolerance
    if cover is not None:
        own &= ~_faces(outline, cover)
    own &= _gap(outline.points_px, outline.points_px[~own]) > CORNER_PX
    return np.asarray(own, dtype=np.bool_)


def hidden_arc(outline: Outline, silhouette: Outline) -> Vectors:
    """Points (M, 2) of the whole silhouette that no visible outline point is near."""
    return silhouette.points_px[_gap(silhouette.points_px, outline.points_px) > CORNER_PX]


def window_around(instance: Instance) -> Region:
    """The mask's window and the margin in which covers are looked for."""
    return instance.visible.region.grown(MARGIN_PX)


def _faces(outline: Outline, cover: Cover) -> BoolMask:
    """Whether something nearer lies just outside each point: two probes of three must say so."""
    hits = np.zeros(len(outline.points_px), dtype=np.int64)
    for distance in PROBES_PX:
        at = np.rint(outline.points_px + distance * outline.outward).astype(np.int64)
        columns = np.clip(at[:, 0] - cover.region.x0, 0, cover.region.width - 1)
        rows = np.clip(at[:, 1] - cover.region.y0, 0, cover.region.height - 1)
        hits += cover.blocked[rows, columns]
    return hits >= 2


def _depth_in(silhouette: FloatMap, points: Vectors) -> Vectors:
    """How far inside a silhouette's zero line each point (N, 2) of its window lies, px."""
    inside = cv2.copyMakeBorder(
        (silhouette > 0).astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0
    )
    depth = cv2.distanceTransform(inside, cv2.DIST_L2, cv2.DIST_MASK_5)
    columns = np.clip(np.rint(points[:, 0]).astype(int) + 1, 0, inside.shape[1] - 1)
    rows = np.clip(np.rint(points[:, 1]).astype(int) + 1, 0, inside.shape[0] - 1)
    return np.asarray(depth[rows, columns] - 0.5, dtype=np.float64)


def _depth_in_hull(points: Vectors) -> Vectors:
    """How far inside the convex hull of all points (N, 2) each one lies, px."""
    if len(points) < 3:
        return np.zeros(len(points))
    hull = cv2.convexHull(points.astype(np.float32)).reshape(-1, 2).astype(np.float64)
    along = np.roll(hull, -1, axis=0) - hull
    length = np.linalg.norm(along, axis=1)
    hull, along = hull[length > 0], along[length > 0] / length[length > 0, None]
    offset = points[:, None] - hull[None]
    cross = along[None, :, 0] * offset[..., 1] - along[None, :, 1] * offset[..., 0]
    return np.asarray(np.abs(cross).min(axis=1), dtype=np.float64)


def _gap(points: Vectors, others: Vectors) -> Vectors:
    """Distance of each point (N, 2) to the nearest of the others (M, 2), px."""
    if len(points) == 0 or len(others) == 0:
        return np.full(len(points), np.inf)
    squares = (points**2).sum(axis=1)[:, None] + (others**2).sum(axis=1) - 2 * points @ others.T
    return np.asarray(np.sqrt(np.maximum(squares.min(axis=1), 0.0)), dtype=np.float64)


def _neighbours(values: Vectors, axis: int) -> tuple[Vectors, Vectors]:
    return (values[:-1], values[1:]) if axis == 0 else (values[:, :-1], values[:, 1:])


def _between(
    values: Vectors, axis: int, at: tuple[npt.NDArray[np.intp], ...], part: Vectors
) -> Vectors:
    first, second = _neighbours(values, axis)
    return np.asarray(first[at] * (1 - part) + second[at] * part, dtype=np.float64)
