"""First hits of rays in a scene, by Embree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from fieldcam.simulator.mesh import F32, I32, Soup, unit

MISS = -1


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """First hits of N rays; where `triangle` is MISS the rest means nothing."""

    triangle: I32
    """(N,)"""
    weights: F32
    """(N, 3) barycentric weights of the triangle's vertices."""
    distance: F32
    """(N,) in lengths of the ray's direction."""

    def of(self, chosen: npt.NDArray[np.int64]) -> Hits:
        """The hits of some of the rays."""
        return Hits(self.triangle[chosen], self.weights[chosen], self.distance[chosen])

    @property
    def found(self) -> npt.NDArray[np.bool_]:
        return np.asarray(self.triangle != MISS)


class RayCaster:
    """Answers rays against one scene."""

    def __init__(self, soup: Soup) -> None:
        self.soup = soup
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, soup.vertices_mm, soup.triangles)

    def first_hits(self, origins_mm: F32, directions: F32) -> Hits:
        """Cast rays (N, 3); a single origin (3,) is shared by all."""
        starts = np.ascontiguousarray(np.broadcast_to(origins_mm, directions.shape), np.float32)
        found = self._scene.run(
            starts, np.ascontiguousarray(directions, np.float32), query="INTERSECT", output=1
        )
        u, v = found["u"], found["v"]
        weights = np.stack([1 - u - v, u, v], axis=-1).astype(np.float32)
        return Hits(found["primID"].astype(np.int32), weights, found["tfar"].astype(np.float32))

    def blocked(self, points_mm: F32, target_mm: F32) -> npt.NDArray[np.bool_]:
        """Whether something stands between each point (N, 3) and one target (3,)."""
        path = (target_mm - points_mm).astype(np.float32)
        starts = points_mm + unit(path) * np.float32(0.15)
        hit = self._scene.run(
            np.ascontiguousarray(starts, np.float32),
            np.ascontiguousarray(path, np.float32),
            query="OCCLUDED",
        )
        return np.asarray(hit != MISS, bool)
