"""Triangle meshes with what the renderer needs at each vertex."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]


class MeshPart(IntEnum):
    """What a triangle belongs to; decides its texture and its truth."""

    FRUIT = 0
    SEPAL = 1
    STEM = 2
    LEAF = 3
    BARK = 4
    TAG = 5
    STRING = 6


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """One connected thing.

    `vertices_mm` (V, 3) and `normals` (V, 3) share a frame; `local` (V, 3) are
    coordinates fixed to the thing, which its texture is looked up by (for a
    leaf or a tag: u and v in 0 to 1); `albedo` (V, 3) is linear RGB.
    """

    vertices_mm: F32
    normals: F32
    local: F32
    albedo: F32
    triangles: I32
    part: MeshPart
    gloss: float = 0.0
    fruitlet: int = -1
    """Index into the scene's fruitlets, -1 for anything else."""

    def moved(self, rotation: F32, translation_mm: F32) -> Mesh:
        """The same thing after x -> rotation (3, 3) @ x + translation (3,)."""
        return replace(
            self,
            vertices_mm=(self.vertices_mm @ rotation.T + translation_mm).astype(np.float32),
            normals=(self.normals @ rotation.T).astype(np.float32),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Soup:
    """All meshes of a scene joined; per-triangle arrays have length T."""

    vertices_mm: F32
    normals: F32
    local: F32
    albedo: F32
    triangles: I32
    part: npt.NDArray[np.uint8]
    gloss: F32
    fruitlet: npt.NDArray[np.int16]
    thing: I32
    """Index of the mesh that a triangle came from: it changes at outlines."""


def join(meshes: Sequence[Mesh]) -> Soup:
    """Join meshes into the arrays that the ray caster takes."""
    counts = [len(m.vertices_mm) for m in meshes]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    sizes = [len(m.triangles) for m in meshes]

    def per_triangle(values: list[float], dtype: npt.DTypeLike) -> npt.NDArray[np.generic]:
        return np.repeat(np.asarray(values, dtype=dtype), sizes)

    return Soup(
        vertices_mm=np.concatenate([m.vertices_mm for m in meshes]).astype(np.float32),
        normals=np.concatenate([m.normals for m in meshes]).astype(np.float32),
        local=np.concatenate([m.local for m in meshes]).astype(np.float32),
        albedo=np.concatenate([m.albedo for m in meshes]).astype(np.float32),
        triangles=np.concatenate(
            [m.triangles + s for m, s in zip(meshes, starts, strict=True)]
        ).astype(np.int32),
        part=per_triangle([m.part for m in meshes], np.uint8),  # type: ignore[arg-type]
        gloss=per_triangle([m.gloss for m in meshes], np.float32),  # type: ignore[arg-type]
        fruitlet=per_triangle([m.fruitlet for m in meshes], np.int16),  # type: ignore[arg-type]
        thing=per_triangle(list(range(len(meshes))), np.int32),  # type: ignore[arg-type]
    )


def unit(vectors: F32) -> F32:
    """Vectors (N, 3) scaled to length one."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return np.asarray(vectors / np.maximum(length, 1e-6)[:, None], np.float32)


def grid_triangles(rows: int, columns: int) -> I32:
    """Two triangles for each cell of a (rows, columns) grid of vertices."""
    index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    return np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)]
    ).astype(np.int32)


def grid_normals(points: F32) -> F32:
    """Unit normals of a (rows, columns, 3) grid of points, flattened to (V, 3)."""
    du = np.gradient(points, axis=1)
    dv = np.gradient(points, axis=0)
    return unit(np.cross(du, dv).reshape(-1, 3))
