"""Meshes of single things: a fruitlet, a leaf, a stem, a tag, each in its own frame.

Lengths are millimetres. A fruitlet's axis is +z from its stem to its calyx end,
with its centre at the origin. A leaf starts at the origin and runs along +x
with its upper face towards +z. A tag lies in the plane z = 0, its image's rows
running down +y.
"""

from __future__ import annotations

import numpy as np

from fieldcam.simulator.mesh import F32, Mesh, MeshPart, grid_normals, grid_triangles
from fieldcam.values import Floats

Rgb = tuple[float, float, float]


def fruitlet(
    diameter_mm: float, elongation: float, skin: F32, gloss: float, index: int, segments: int = 64
) -> Mesh:
    """A slightly elongated fruitlet with shallow hollows at both ends.

    The cross-section at its equator is a circle of `diameter_mm`, which is
    therefore the short axis of its silhouette from every side. `skin` is
    (3, 3): linear RGB at the stem end, the equator and the calyx end.
    """
    radius, half_length = diameter_mm / 2, diameter_mm / 2 * elongation
    polar: F32 = np.linspace(0.0, np.pi, segments // 2 + 1, dtype=np.float32)
    around = np.linspace(0.0, 2 * np.pi, segments + 1, dtype=np.float32)
    hollow = 1.0 - 0.16 * np.exp(-((np.sin(polar) / 0.3) ** 2))
    profile = -np.cos(polar) * hollow
    axial = (half_length * profile / profile.max())[:, None] * np.ones_like(around)
    across = (radius * np.sin(polar))[:, None]
    grid = np.stack([across * np.cos(around), across * np.sin(around), axial], -1)
    points: F32 = grid.astype(np.float32)
    vertices: F32 = points.reshape(-1, 3)
    return Mesh(
        vertices_mm=vertices,
        normals=grid_normals_closed(points),
        local=vertices,
        albedo=np.repeat(_blend(skin, (1 - np.cos(polar)) / 2), len(around), axis=0),
        triangles=grid_triangles(len(polar), len(around)),
        part=MeshPart.FRUIT,
        gloss=gloss,
        fruitlet=index,
    )


def grid_normals_closed(points: F32) -> F32:
    """Normals of a grid whose last column repeats its first (V, 3)."""
    wrapped = np.concatenate([points[:, -2:-1], points, points[:, 1:2]], axis=1)
    rows, columns = points.shape[:2]
    normals = grid_normals(wrapped).reshape(rows, columns + 2, 3)[:, 1:-1]
    normals[0], normals[-1] = [0, 0, -1], [0, 0, 1]
    return np.ascontiguousarray(normals.reshape(-1, 3))


def _blend(colors: F32, position: Floats) -> F32:
    """Linear interpolation of three colours at positions 0 to 1 (N, 3)."""
    knots = np.array([0.0, 0.5, 1.0])
    return np.stack([np.interp(position, knots, colors[:, c]) for c in range(3)], axis=-1).astype(
        np.float32
    )


def sepals(
    diameter_mm: float,
    elongation: float,
    length_mm: float,
    spread: float,
    color: Rgb,
    count: int = 5,
) -> list[Mesh]:
    """The dried calyx lobes at the fruitlet's far end.

    `spread` is 0 for lobes closed along the axis and 1 for lobes laid flat.
    """
    base_z = diameter_mm / 2 * elongation * 0.84
    ring = diameter_mm * 0.11
    lobes = []
    for angle in np.arange(count) * 2 * np.pi / count:
        along = np.linspace(0, 1, 6, dtype=np.float32)
        tilt = spread * 1.4 * (0.4 + 0.6 * along)
        out = ring + length_mm * np.cumsum(np.sin(tilt)) / len(along)
        up = base_z + length_mm * np.cumsum(np.cos(tilt)) / len(along)
        half_width = length_mm * 0.22 * (1 - along**1.5) + 0.05
        side = np.array([-1.0, 0.0, 1.0], dtype=np.float32)
        radial = np.array([np.cos(angle), np.sin(angle), 0.0])
        tangent = np.array([-np.sin(angle), np.cos(angle), 0.0])
        points = (
            out[:, None, None] * radial
            + up[:, None, None] * np.array([0, 0, 1.0])
            + (half_width[:, None] * side)[:, :, None] * tangent
        )
        lobes.append(_sheet(points.astype(np.float32), color, MeshPart.SEPAL))
    return lobes


def leaf(
    length_mm: float, width_mm: float, bend_rad: float, fold_rad: float, teeth: float, color: Rgb
) -> Mesh:
    """A leaf blade, bent down along its length and folded along its midrib."""
    rows, columns = 37, 9
    along = np.linspace(0, 1, rows, dtype=np.float32)
    outline = np.clip(np.sin(np.pi * along**0.8), 0, 1) ** 0.75
    outline = outline * (1 + teeth * (np.arange(rows) % 2 - 0.5)) + 0.01
    across = np.linspace(-1, 1, columns, dtype=np.float32)
    direction = bend_rad * along
    x = np.cumsum(np.cos(direction)) * length_mm / rows
    z = -np.cumsum(np.sin(direction)) * length_mm / rows
    half = outline[:, None] * across * width_mm / 2
    ripple = 0.04 * width_mm * np.sin(9 * along)[:, None] * across**2
    points = np.stack(
        [
            np.broadcast_to(x[:, None], half.shape),
            half * np.cos(fold_rad),
            z[:, None] + np.abs(half) * np.sin(fold_rad) + ripple,
        ],
        -1,
    ).astype(np.float32)
    mesh = _sheet(points, color, MeshPart.LEAF)
    v, u = np.meshgrid(across, along)
    local = np.stack([u * length_mm, v * outline[:, None] * width_mm / 2, 0 * u], -1)
    return Mesh(
        mesh.vertices_mm, mesh.normals, local.reshape(-1, 3).astype(np.float32),
        mesh.albedo, mesh.triangles, MeshPart.LEAF, gloss=0.25,
    )  # fmt: skip


def tube(path_mm: F32, radius_mm: Floats, color: Rgb, part: MeshPart, sides: int = 10) -> Mesh:
    """A round stem along a path (N, 3) with a radius at each point (N,)."""
    heading = np.gradient(path_mm, axis=0)
    heading /= np.maximum(np.linalg.norm(heading, axis=1, keepdims=True), 1e-6)
    helper = np.array([0.31, 0.77, 0.56])
    first = np.cross(heading, helper)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-6)
    second = np.cross(heading, first)
    turn = np.linspace(0, 2 * np.pi, sides + 1)
    normals = first[:, None] * np.cos(turn)[:, None] + second[:, None] * np.sin(turn)[:, None]
    points = path_mm[:, None] + normals * radius_mm[:, None, None]
    vertices = points.reshape(-1, 3).astype(np.float32)
    return Mesh(
        vertices_mm=vertices,
        normals=normals.reshape(-1, 3).astype(np.float32),
        local=vertices,
        albedo=np.tile(np.asarray(color, np.float32), (len(vertices), 1)),
        triangles=grid_triangles(len(path_mm), sides + 1),
        part=part,
        gloss=0.1,
    )


def arc(start_mm: F32, end_mm: F32, sag_mm: float, points: int = 12) -> F32:
    """A path from start to end that sags towards +y, gravity's direction (N, 3)."""
    t = np.linspace(0, 1, points, dtype=np.float32)[:, None]
    path = start_mm + (end_mm - start_mm) * t
    path[:, 1] += (4 * sag_mm * t * (1 - t))[:, 0]
    return np.asarray(path, dtype=np.float32)


def tag_card(card_mm: float, paper: Rgb) -> Mesh:
    """A square card; `local` is (x, y, 0) in mm from its centre, for its print."""
    side = np.linspace(-card_mm / 2, card_mm / 2, 5, dtype=np.float32)
    x, y = np.meshgrid(side, side)
    bow = 0.0004 * (x**2 - y**2)
    mesh = _sheet(np.stack([x, y, bow], -1).astype(np.float32), paper, MeshPart.TAG)
    local = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    return Mesh(
        mesh.vertices_mm, mesh.normals, local.astype(np.float32),
        mesh.albedo, mesh.triangles, MeshPart.TAG, gloss=0.05,
    )  # fmt: skip


def _sheet(points: F32, color: Rgb, part: MeshPart) -> Mesh:
    vertices = points.reshape(-1, 3)
    return Mesh(
        vertices_mm=vertices,
        normals=grid_normals(points),
        local=vertices,
        albedo=np.tile(np.asarray(color, np.float32), (len(vertices), 1)),
        triangles=grid_triangles(points.shape[0], points.shape[1]),
        part=part,
    )
