"""One cluster: fruitlets on stems around a spur, with the spur's own leaves.

Frame: origin at the spur, x right, y down (gravity), z away from the operator,
millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from fieldcam.simulator import shapes
from fieldcam.simulator.mesh import F32, Mesh, MeshPart
from fieldcam.simulator.style import Style, varied
from fieldcam.values import Floats


@dataclass(frozen=True, slots=True)
class TrueSize:
    """The size of one fruitlet on one day."""

    diameter_mm: float
    elongation: float


@dataclass(frozen=True, slots=True, eq=False)
class HungFruitlet:
    """Where a fruitlet hangs: centre (3,) in mm and unit axis (3,) from stem to calyx."""

    size: TrueSize
    center_mm: F32
    axis: F32


def heading(rng: np.random.Generator) -> F32:
    """A spur's direction (3,): mostly towards the operator, any side up."""
    toward = np.array([rng.normal(0, 0.6), rng.normal(0.1, 0.6), -1.0])
    return _unit(toward)


def stem_directions(rng: np.random.Generator, count: int, along: F32) -> F32:
    """Unit stem directions (count, 3): the king along the spur, the others around it."""
    first, second = _frame(along)
    start = rng.uniform(0, 2 * np.pi)
    directions = [_unit(along + 0.2 * rng.normal(size=3))]
    for i in range(1, count):
        angle = start + 2 * np.pi * i / max(count - 1, 1) + rng.normal(0, 0.25)
        lean = rng.uniform(0.7, 1.35)
        ring = first * np.cos(angle) + second * np.sin(angle)
        directions.append(_unit(along * np.cos(lean) + ring * np.sin(lean)))
    return np.stack(directions).astype(np.float32)


def hang(
    rng: np.random.Generator, sizes: list[TrueSize], directions: F32, stems_mm: Floats, sag: float
) -> list[HungFruitlet]:
    """Put fruitlets at the ends of their stems, let them sag, and push them apart."""
    down = np.array([0, 1.0, 0])
    bent = np.stack(
        [_unit(d + sag * s.diameter_mm / 12 * down) for d, s in zip(directions, sizes, strict=True)]
    )
    radii = np.array([s.diameter_mm / 2 * s.elongation for s in sizes])
    centers = bent * (stems_mm + radii)[:, None]
    for _ in range(40):
        gap = centers[:, None] - centers[None]
        distance = np.linalg.norm(gap, axis=-1) + np.eye(len(sizes)) * 1e6
        overlap = np.clip(radii[:, None] + radii[None] + 0.4 - distance, 0, None)
        if overlap.max() <= 0:
            break
        centers += (gap / distance[..., None] * overlap[..., None]).sum(axis=1) * 0.55
    axes = [_unit(c + rng.normal(0, 0.18, 3) * np.linalg.norm(c)) for c in centers]
    return [
        HungFruitlet(s, c.astype(np.float32), a)
        for s, c, a in zip(sizes, centers, axes, strict=True)
    ]


def fruitlet_meshes(
    rng: np.random.Generator,
    placed: HungFruitlet,
    style: Style,
    index: int,
    skin: F32,
    segments: int,
) -> list[Mesh]:
    """The fruitlet, its calyx and its stem, placed in the spur's frame."""
    size = placed.size
    rotation = _to_axis(placed.axis, rng.uniform(0, 2 * np.pi))
    parts = [
        shapes.fruitlet(size.diameter_mm, size.elongation, skin, style.skin_gloss, index, segments)
    ]
    withered = float(np.clip((11 - size.diameter_mm) / 6, 0, 1))
    lobe_mm = size.diameter_mm * rng.uniform(0.16, 0.3) + withered * rng.uniform(0.5, 2.5)
    color = varied(rng, style.sepal, 0.15)
    parts += shapes.sepals(
        size.diameter_mm,
        size.elongation,
        lobe_mm,
        style.sepal_spread * rng.uniform(0.5, 1.2),
        rgb(color),
    )
    if rng.random() < 0.7 * withered:
        dried = varied(rng, np.array([0.35, 0.25, 0.15], np.float32), 0.3)
        parts += shapes.sepals(
            size.diameter_mm,
            size.elongation,
            lobe_mm * rng.uniform(0.8, 1.6),
            0.15,
            rgb(dried),
            count=9,
        )
    moved = [m.moved(rotation, placed.center_mm) for m in parts]
    neck = placed.center_mm - placed.axis * size.diameter_mm / 2 * size.elongation * 0.86
    path = shapes.arc(np.zeros(3, np.float32), neck.astype(np.float32), rng.uniform(-1.5, 2.5))
    radius = np.linspace(1.1, 0.75, len(path)) * rng.uniform(0.8, 1.3)
    return [*moved, shapes.tube(path, radius, rgb(varied(rng, style.stem, 0.1)), MeshPart.STEM)]


def leaf_meshes(
    rng: np.random.Generator, style: Style, along: F32, count: int, scale: float = 1.0
) -> list[Mesh]:
    """Leaves on petioles around the spur, leaning away from its direction."""
    first, second = _frame(along)
    meshes = []
    for _ in range(count):
        angle, lean = rng.uniform(0, 2 * np.pi), rng.uniform(0.9, 2.2)
        ring = first * np.cos(angle) + second * np.sin(angle)
        direction = _unit(along * np.cos(lean) + ring * np.sin(lean))
        foot = (direction * rng.uniform(14, 42) * scale).astype(np.float32)
        petiole = shapes.arc(np.zeros(3, np.float32), foot, rng.uniform(-4, 4))
        meshes.append(
            shapes.tube(petiole, np.full(len(petiole), 0.8), rgb(style.stem), MeshPart.STEM, 6)
        )
        meshes.append(blade(rng, style, foot, direction, scale))
    return meshes


def blade(
    rng: np.random.Generator, style: Style, foot_mm: F32, direction: F32, scale: float = 1.0
) -> Mesh:
    """One leaf blade that starts at a point (3,) and runs along a direction (3,)."""
    length = rng.uniform(30, 75) * scale
    mesh = shapes.leaf(
        length,
        length * style.leaf_width * rng.uniform(0.8, 1.2),
        rng.uniform(-0.3, 1.2),
        rng.uniform(0.0, 0.6),
        style.leaf_teeth,
        rgb(varied(rng, style.leaf, 0.2)),
    )
    side = _unit(np.cross(direction, _unit(rng.normal(size=3))))
    up = np.cross(direction, side)
    return mesh.moved(np.stack([direction, side, up], axis=1).astype(np.float32), foot_mm)


def rgb(color: F32) -> shapes.Rgb:
    return float(color[0]), float(color[1]), float(color[2])


def _unit(vector: Floats) -> F32:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-9), dtype=np.float32)


def _frame(along: F32) -> tuple[F32, F32]:
    """Two unit vectors that make a frame with a direction."""
    first = _unit(np.cross(along, [0.3, 0.5, 0.81]))
    return first, _unit(np.cross(along, first))


def _to_axis(axis: F32, twist_rad: float) -> F32:
    """A rotation that takes +z to an axis, after a twist about +z."""
    first, second = _frame(axis)
    turned = np.stack([first, second, axis], axis=1)
    if np.linalg.det(turned) < 0:
        turned[:, 1] *= -1
    return (turned @ Rotation.from_rotvec([0, 0, twist_rad]).as_matrix()).astype(np.float32)
