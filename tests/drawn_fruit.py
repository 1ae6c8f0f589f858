"""Fruitlets drawn from their equations: exact silhouettes, surfaces and disparities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldcam.values import (
    Calibration,
    DisparityWindow,
    Instance,
    Mask,
    Region,
)

Vectors = npt.NDArray[np.float64]
CAMERA = Calibration(1440, 1080, 1717.0, 700.0, 495.0, 60.0)
SOFT_PX = 4.0


@dataclass(frozen=True, slots=True)
class Fruit:
    """A spheroid; `axis` is its direction from stem to calyx."""

    center_mm: tuple[float, float, float]
    diameter_mm: float
    elongation: float = 1.0
    axis: tuple[float, float, float] = (0.0, 1.0, 0.0)

    @property
    def form(self) -> Vectors:
        """(3, 3) A of (x - c) A (x - c) = 1."""
        axis = np.array(self.axis) / np.linalg.norm(self.axis)
        radius = self.diameter_mm / 2
        along = np.outer(axis, axis)
        return (np.eye(3) - along) / radius**2 + along / (radius * self.elongation) ** 2


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """What perfect networks would say about a drawn scene."""

    instances: tuple[Instance, ...]
    """In the order of the fruits; those without visible pixels are left out."""
    indices: tuple[int, ...]
    """Of the fruit behind each instance."""
    window: DisparityWindow
    visible_fraction: tuple[float, ...]


def draw(
    fruits: Sequence[Fruit],
    camera: Calibration = CAMERA,
    wall_mm: float = 520.0,
    covers: Sequence[tuple[Region, float]] = (),
) -> Drawn:
    """Draw fruits in front of a wall, with rectangles (region, range) as covers."""
    shape = (camera.height_px, camera.width_px)
    depth = np.full(shape, wall_mm)
    owner = np.full(shape, -1)
    for region, range_mm in covers:
        nearer = depth[region.slices] > range_mm
        depth[region.slices][nearer] = range_mm
        owner[region.slices][nearer] = -2
    edges = []
    for k, fruit in enumerate(fruits):
        window, inside, z = _project(fruit, camera)
        edges.append((window, inside))
        nearer = (inside > 0) & (z < depth[window.slices])
        depth[window.slices][nearer] = z[nearer]
        owner[window.slices][nearer] = k
    disparity = (camera.focal_px * camera.baseline_mm / depth).astype(np.float32)
    found = [(k, _instance(k, window, inside, owner)) for k, (window, inside) in enumerate(edges)]
    seen = [(k, i) for k, i in found if i.visible.area_px > 0]
    return Drawn(
        tuple(i for _, i in seen),
        tuple(k for k, _ in seen),
        DisparityWindow(Region(0, 0, camera.width_px, camera.height_px), disparity),
        tuple(i.visible.area_px / float((edges[k][1] > 0).sum()) for k, i in seen),
    )


def _instance(k: int, window: Region, inside: Vectors, owner: npt.NDArray[np.int_]) -> Instance:
    """Soft logits: distance to the silhouette, and to whatever covers it."""
    around = owner[window.slices]
    covered = (inside > 0) & (around != k)
    visible = np.minimum(inside, _signed_distance(~covered)) if covered.any() else inside
    logits = (6 * np.tanh(visible / SOFT_PX)).astype(np.float32)
    rows, columns = np.nonzero(logits > 0)
    box = (0.0, 0.0, 0.0, 0.0)
    if rows.size:
        box = (
            float(columns.min() + window.x0),
            float(rows.min() + window.y0),
            float(columns.max() + window.x0 + 1),
            float(rows.max() + window.y0 + 1),
        )
    return Instance(
        box_px=box,
        score=0.99 - 0.001 * k,
        visible=Mask(window.x0, window.y0, logits > 0),
        visible_logits=logits,
        whole_logits=(6 * np.tanh(inside / SOFT_PX)).astype(np.float32),
    )


def _signed_distance(inside: npt.NDArray[np.bool_]) -> Vectors:
    import cv2

    to_outside = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    to_inside = cv2.distanceTransform(
        (~inside).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
    )
    return np.where(inside, to_outside - 0.5, 0.5 - to_inside)


def _project(fruit: Fruit, camera: Calibration) -> tuple[Region, Vectors, Vectors]:
    """A window, the signed distance inside the silhouette (px), and the surface's depth."""
    center, form = np.array(fruit.center_mm), fruit.form
    constant = center @ form @ center - 1
    u, v = camera.focal_px * center[:2] / center[2] + (camera.cx_px, camera.cy_px)
    half = 0.75 * fruit.diameter_mm * fruit.elongation * camera.focal_px / center[2] + 10
    window = Region(
        max(int(u - half), 0),
        max(int(v - half), 0),
        min(int(u + half), camera.width_px),
        min(int(v + half), camera.height_px),
    )
    rows, columns = np.mgrid[window.y0 : window.y1, window.x0 : window.x1]
    x = (columns - camera.cx_px) / camera.focal_px
    y = (rows - camera.cy_px) / camera.focal_px
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    a = np.einsum("hwi,ij,hwj->hw", rays, form, rays)
    b = rays @ form @ center
    discriminant = b**2 - a * constant
    z = (b - np.sqrt(np.maximum(discriminant, 0))) / a
    conic = np.outer(form @ center, form @ center) - constant * form
    return window, _conic_distance(conic, x, y) * camera.focal_px, z


def _conic_distance(conic: Vectors, x: Vectors, y: Vectors) -> Vectors:
    """First-order distance inside the ellipse d Q d = 0 on the plane z = 1."""
    center = np.linalg.solve(conic[:2, :2], -conic[:2, 2])
    level = conic[2, 2] + conic[2, :2] @ center
    values, axes = np.linalg.eigh(-conic[:2, :2] / level)
    shape = axes @ np.diag(np.sqrt(values)) @ axes.T
    mapped = (np.stack([x, y], axis=-1) - center) @ shape
    radius = np.maximum(np.linalg.norm(mapped, axis=-1), 1e-9)
    steep = np.linalg.norm(mapped @ shape, axis=-1) / radius
    return np.asarray((1 - radius) / np.maximum(steep, 1e-9), dtype=np.float64)
