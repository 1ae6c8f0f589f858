"""What is really there: the truth that belongs to a simulated capture."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from fieldcam.simulator.mesh import F32, MeshPart
from fieldcam.simulator.render import EyeView, Renderer
from fieldcam.values import BoolMask, FloatMap, Mask

SAME_PX = 0.5
"""Disparities that differ by less belong to one surface."""
NEARER_PX = 1.5
"""Something whose disparity is larger by this stands in front."""


@dataclass(frozen=True, slots=True, eq=False)
class TrueFruitlet:
    """One fruitlet that stands at least partly in the left image."""

    id: int
    """Identity over the days of its cluster; -1 for another cluster's fruitlet."""
    in_target: bool
    diameter_mm: float
    center_mm: tuple[float, float, float]
    """Its middle in the camera frame, behind the visible surface."""
    center_px: tuple[float, float]
    box_px: tuple[float, float, float, float]
    """Of the visible part; of the whole silhouette where nothing is visible."""
    visible: Mask
    whole: Mask
    whole_area_px: int
    """Of the whole silhouette, also beyond the image's border."""

    @property
    def range_mm(self) -> float:
        return self.center_mm[2]

    @property
    def visible_fraction(self) -> float:
        return self.visible.area_px / max(self.whole_area_px, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """Truth in the rectified left image, and its disparity."""

    tag_id: int
    tag_center_mm: tuple[float, float, float]
    tag_rotation: F32
    fruitlets: tuple[TrueFruitlet, ...]
    left_disparity_px: FloatMap
    """(H, W) NaN where nothing is hit."""
    left_matched: BoolMask
    """(H, W) the point is also seen in the right image."""

    @property
    def target(self) -> tuple[TrueFruitlet, ...]:
        return tuple(f for f in self.fruitlets if f.in_target)


def disparity(renderer: Renderer, view: EyeView) -> FloatMap:
    """Disparity (h, w) of one eye's view, NaN where nothing is hit."""
    c = renderer.calibration
    with np.errstate(divide="ignore"):
        found = c.range_mm(view.depth_mm)
    return np.where(np.isfinite(view.depth_mm), found, np.nan).astype(np.float32)


def matched(
    renderer: Renderer, view: EyeView, other: EyeView, eye_x_mm: float, other_x_mm: float
) -> BoolMask:
    """Pixels (h, w) whose point the other eye sees inside its image.

    The other view's depth answers for most; rays are cast at its edges only.
    """
    c = renderer.calibration
    points = renderer.points_mm(view) + np.array([eye_x_mm, 0, 0], np.float32)
    with np.errstate(invalid="ignore"):
        column = (points[..., 0] - other_x_mm) / points[..., 2] * c.focal_px + c.cx_px
        inside = (column >= 0) & (column <= c.width_px - 1)
    seen, sure = _compared(disparity(renderer, view), disparity(renderer, other), column, other)
    doubtful = inside & ~sure
    seen[doubtful] = renderer.seen_from(points[doubtful], other_x_mm)
    return np.asarray(seen & inside)


def _compared(
    own: FloatMap, others: FloatMap, column: F32, other: EyeView
) -> tuple[BoolMask, BoolMask]:
    """By the other view's disparity, of the same rows: what it sees, and where that is sure."""
    height, width = others.shape
    start = np.floor(np.nan_to_num(column, nan=-1e6)).astype(np.int64) - other.region.x0
    rows = np.arange(height)[:, None]
    known = (start >= 0) & (start + 1 < width)
    clipped = np.clip(start, 0, width - 2)
    first, second = (np.nan_to_num(others[rows, clipped + k]) for k in (0, 1))
    nearer = np.minimum(first, second) > own + NEARER_PX
    same = (np.abs(first - own) < SAME_PX) & (np.abs(second - own) < SAME_PX)
    return same, np.asarray(known & (same | nearer))


def true_fruitlets(renderer: Renderer, view: EyeView) -> tuple[TrueFruitlet, ...]:
    """All fruitlets whose silhouette reaches into the left view."""
    soup = renderer.soup
    known = []
    for index, fruitlet in enumerate(renderer.scene.fruitlets):
        own = (soup.fruitlet == index) & (soup.part == MeshPart.FRUIT)
        vertices = soup.vertices_mm[np.unique(soup.triangles[own])]
        if len(vertices) == 0 or vertices[:, 2].min() < 50:
            continue
        outline = _outline_px(renderer, vertices)
        whole = _filled(outline, view)
        if whole is None:
            continue
        window = view.fruitlet[whole.region.slices_in(view.region)] == index
        visible = Mask(whole.x0, whole.y0, window)
        center = renderer.pose.apply(fruitlet.center_mm)
        x, y = renderer.calibration.places_px(center)
        known.append(
            TrueFruitlet(
                id=fruitlet.id,
                in_target=fruitlet.in_target,
                diameter_mm=fruitlet.diameter_mm,
                center_mm=(float(center[0]), float(center[1]), float(center[2])),
                center_px=(float(x), float(y)),
                box_px=_box(visible if visible.area_px else whole),
                visible=visible,
                whole=whole,
                whole_area_px=round(float(cv2.contourArea(outline))),
            )
        )
    return tuple(known)


def _outline_px(renderer: Renderer, vertices_mm: F32) -> F32:
    """Silhouette of a convex thing in the left image, as a polygon (N, 2)."""
    projected = renderer.calibration.places_px(vertices_mm).astype(np.float32)
    return np.asarray(cv2.convexHull(projected).reshape(-1, 2), np.float32)


def _filled(outline: F32, view: EyeView) -> Mask | None:
    """Pixels of the view whose centres lie inside a convex polygon."""
    low = np.maximum(np.floor(outline.min(axis=0)).astype(int), [view.region.x0, view.region.y0])
    high = np.minimum(
        np.ceil(outline.max(axis=0)).astype(int) + 1, [view.region.x1, view.region.y1]
    )
    if np.any(high <= low):
        return None
    rows, columns = np.mgrid[low[1] : high[1], low[0] : high[0]].astype(np.float32)
    ahead = np.roll(outline, -1, axis=0) - outline
    side = ahead[:, 0] * (rows[..., None] - outline[:, 1]) - ahead[:, 1] * (
        columns[..., None] - outline[:, 0]
    )
    inside = np.all(side >= 0, axis=-1) | np.all(side <= 0, axis=-1)
    return Mask(int(low[0]), int(low[1]), inside) if inside.any() else None


def _box(mask: Mask) -> tuple[float, float, float, float]:
    seen = mask.tight.region
    return float(seen.x0), float(seen.y0), float(seen.x1), float(seen.y1)
