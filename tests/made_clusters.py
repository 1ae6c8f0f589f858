"""Clusters of spheres in space, as a camera would read them, for tests of association."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import date, timedelta

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fieldcam.growth.places import ClusterVisit, View
from fieldcam.values import (
    Calibration,
    ClusterReading,
    DisparityWindow,
    Expectation,
    Flag,
    Fruitlet,
    Mask,
    Region,
    Settings,
    Status,
    TagPose,
    Verdict,
)

F64 = npt.NDArray[np.float64]
CAMERA = Calibration(1440, 1080, 1717.0, 720.0, 540.0, 60.0)
BEHIND_MM = 650.0
"""Range of what stands behind every cluster."""
FIRST_DAY = date(2026, 5, 21)
RING = np.array(
    [[0.0, -4, -9], [17, -7, 3], [6, 15, 8], [-13, 10, -5], [-16, -9, 6], [3, -19, 4]], np.float64
)
"""Middles of six fruitlets about their spur, mm."""


@dataclass(frozen=True, slots=True, eq=False)
class Sphere:
    """One fruitlet."""

    id: int
    center_mm: F64
    """From the cluster's middle."""
    diameter_mm: float | None = 8.0
    """None for one that is seen, but not sized."""
    sd_mm: float | None = None
    """Standard deviation of the diameter, as its reading says."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """How a cluster and its tag stand before the camera."""

    turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    middle_mm: tuple[float, float, float] = (0.0, 0.0, 440.0)
    tag_from_middle_mm: tuple[float, float, float] = (45.0, 20.0, -5.0)
    tagged: bool = True
    leaf_mm: Mapping[str, float] = field(default_factory=dict)
    """A leaf before the cluster that covers x from `from` to `to` (mm, at its middle)."""


def ring(sizes_mm: Iterable[float | None] = (9.0, 8.0, 7.5, 8.5, 6.5, 7.0)) -> list[Sphere]:
    """As many fruitlets as sizes, up to six."""
    return [Sphere(k, RING[k], size) for k, size in enumerate(sizes_mm)]


def made_view(name: str, spheres: Iterable[Sphere], pose: Pose | None = None) -> View:
    """A picture of a cluster; ids of its fruitlets are those of the spheres."""
    pose = pose or Pose()
    turn = Rotation.from_rotvec(pose.turn_rad).as_matrix()
    placed = [(s, turn @ s.center_mm + pose.middle_mm) for s in spheres]
    reading = ClusterReading(
        tag=_tag(pose) if pose.tagged else None,
        tags_seen=(17,),
        fruitlets=tuple(_fruitlet(s, center) for s, center in placed),
        verdict=Verdict(Status.ACCEPT),
        window=_window(pose, placed),
        calibration=CAMERA,
        settings=Settings(),
        expectation=Expectation(),
    )
    return View(name, reading)


def made_visit(day: int, *views: View) -> ClusterVisit:
    return ClusterVisit(FIRST_DAY + timedelta(days=day), views)


def _tag(pose: Pose) -> TagPose:
    x, y, z = np.add(pose.middle_mm, pose.tag_from_middle_mm)
    turn = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return TagPose(17, _project(x, y, z), ((0.0, 0.0),) * 4, (x, y, z), turn, 60.0)


def _project(x: float, y: float, z: float) -> tuple[float, float]:
    return x / z * CAMERA.focal_px + CAMERA.cx_px, y / z * CAMERA.focal_px + CAMERA.cy_px


def _fruitlet(sphere: Sphere, center: F64) -> Fruitlet:
    radius = (sphere.diameter_mm or 8.0) / 2
    x, y = _project(*center)
    half_px = radius / center[2] * CAMERA.focal_px
    side = int(2 * half_px) + 2
    rows, columns = np.mgrid[:side, :side] - side / 2
    return Fruitlet(
        id=sphere.id,
        in_target=True,
        diameter_mm=sphere.diameter_mm,
        sd_mm=sphere.sd_mm,
        center_px=(x, y),
        box_px=(x - half_px, y - half_px, x + half_px, y + half_px),
        score=0.97,
        disparity_px=CAMERA.disparity_px(center[2] - 0.7 * radius),
        range_mm=float(center[2] - 0.7 * radius),
        visible_fraction=0.95,
        flags=() if sphere.diameter_mm is not None else (Flag.HIDDEN,),
        mask=Mask(int(x - half_px), int(y - half_px), np.hypot(rows, columns) <= half_px),
        outline=None,
        cluster=0,
        centroid_mm=(float(center[0]), float(center[1]), float(center[2] - 0.7 * radius)),
        cloud_mm=_surface(center, radius),
    )


def _surface(center: F64, radius: float) -> npt.NDArray[np.float32]:
    """Points of the half that faces the camera."""
    k = np.arange(60)
    z = -(k + 0.5) / 60
    around = k * np.pi * (3 - np.sqrt(5))
    level = np.sqrt(1 - z**2)
    unit = np.stack([level * np.cos(around), level * np.sin(around), z], axis=1)
    return (center + radius * unit).astype(np.float32)


def _window(pose: Pose, placed: Iterable[tuple[Sphere, F64]]) -> DisparityWindow:
    """Fruitlets and leaf before a far background, as discs and a strip."""
    region = Region(420, 240, 1020, 840)
    disparity = np.full((region.height, region.width), CAMERA.disparity_px(BEHIND_MM), np.float32)
    rows, columns = np.mgrid[region.y0 : region.y1, region.x0 : region.x1]
    for sphere, center in placed:
        radius = (sphere.diameter_mm or 8.0) / 2
        x, y = _project(*center)
        inside = np.hypot(columns - x, rows - y) <= radius / center[2] * CAMERA.focal_px
        disparity[inside] = CAMERA.disparity_px(center[2] - 0.7 * radius)
    if pose.leaf_mm:
        x, _, z = pose.middle_mm
        edges = [_project(x + pose.leaf_mm[k], 0, z)[0] for k in ("from", "to")]
        disparity[(columns >= edges[0]) & (columns <= edges[1])] = CAMERA.disparity_px(z - 40)
    return DisparityWindow(region, disparity)
