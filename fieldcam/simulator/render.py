"""Renders one eye of the camera, with the geometry behind every pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldcam.simulator.light import SceneLight
from fieldcam.simulator.mesh import F32, I32, Soup, join, unit
from fieldcam.simulator.raycast import MISS, Hits, RayCaster
from fieldcam.simulator.scene import Scene
from fieldcam.simulator.texture import reflectance, tag_image
from fieldcam.values import Calibration, Region

_SUBPIXELS = np.array(
    [[-0.375, -0.125], [-0.125, 0.375], [0.125, -0.375], [0.375, 0.125]],
    np.float32,
)  # fmt: skip
"""Where inside a pixel an outline is sampled again."""
_CHUNK = 65_536
"""Rays that are shaded at once: what the processor's cache holds."""
_NEIGHBOURS = ((0, 0), (0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))
I64 = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class EyePose:
    """Scene to camera: x -> rotation @ x + translation_mm."""

    rotation: F32
    translation_mm: F32

    def apply(self, points_mm: F32) -> F32:
        return np.asarray(points_mm @ self.rotation.T + self.translation_mm, np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class EyeView:
    """What one eye sees through a window of its image, of shape (h, w)."""

    region: Region
    radiance: F32
    """(h, w, 3) linear RGB."""
    depth_mm: F32
    """(h, w) z at pixel centres, infinite where nothing is hit."""
    fruitlet: npt.NDArray[np.int16]
    """(h, w) index of the fruitlet at pixel centres, -1 elsewhere."""


class Renderer:
    """One posed and lit scene, ready to be looked at by either eye."""

    def __init__(
        self, scene: Scene, pose: EyePose, calibration: Calibration, light: SceneLight
    ) -> None:
        self.scene, self.pose, self.calibration, self.light = scene, pose, calibration, light
        moved = [m.moved(pose.rotation, pose.translation_mm) for m in scene.meshes]
        self.soup: Soup = join(moved)
        self.caster = RayCaster(self.soup)
        self._tag = tag_image(scene.tag_id)

    def view(self, eye_x_mm: float, region: Region) -> EyeView:
        """Render a window as seen from (eye_x_mm, 0, 0); smooth at outlines only."""
        places = _pixel_centres(region)
        rays, hits = self._cast(eye_x_mm, places)
        color = self._color(eye_x_mm, rays, hits)
        shape = (region.height, region.width)
        thing = self._things(hits).reshape(shape)
        rough = np.flatnonzero(_outlines(thing).ravel())
        smooth = color[rough]
        for shift in _SUBPIXELS:
            smooth += self._between(eye_x_mm, places[rough] + shift, rough, thing, color)
        color[rough] = smooth / (len(_SUBPIXELS) + 1)
        depth_mm, fruitlet = self._geometry(hits, region)
        return EyeView(region, color.reshape(*shape, 3), depth_mm, fruitlet)

    def _between(self, eye_x_mm: float, places: F32, pixels: I64, thing: I32, color: F32) -> F32:
        """Colours (N, 3) at places beside pixels: a neighbour's of the same thing, else shaded."""
        rays, hits = self._cast(eye_x_mm, places)
        wanted = self._things(hits)
        height, width = thing.shape
        row, column = np.divmod(pixels, width)
        source = np.full(len(pixels), MISS, np.int64)
        for down, right in _NEIGHBOURS:
            beside = (row + down).clip(0, height - 1) * width + (column + right).clip(0, width - 1)
            fits = (source == MISS) & (thing.ravel()[beside] == wanted)
            source[fits] = beside[fits]
        out = color[source]
        new = np.flatnonzero(source == MISS)
        out[new] = self._color(eye_x_mm, rays[new], hits.of(new))
        return out

    def seen_from(self, points_mm: F32, eye_x_mm: float) -> npt.NDArray[np.bool_]:
        """Which points (N, 3) of the scene's surfaces an eye sees."""
        return ~self.caster.blocked(points_mm, np.array([eye_x_mm, 0, 0], np.float32))

    def points_mm(self, view: EyeView) -> F32:
        """Surface points (h, w, 3) behind a left-eye view's pixels."""
        rays = self._rays(_pixel_centres(view.region)).reshape(*view.depth_mm.shape, 3)
        depth_mm = np.where(np.isfinite(view.depth_mm), view.depth_mm, np.nan)
        return np.asarray(rays * depth_mm[..., None], np.float32)

    def _color(self, eye_x_mm: float, rays: F32, hits: Hits) -> F32:
        """Colours (N, 3) that rays from an eye bring back."""
        eye = np.array([eye_x_mm, 0, 0], np.float32)
        found, missed = np.flatnonzero(hits.found), np.flatnonzero(~hits.found)
        color = np.empty((len(rays), 3), np.float32)
        color[missed] = self.light.far(rays[missed, :2])
        for start in range(0, len(found), _CHUNK):
            part = found[start : start + _CHUNK]
            color[part] = self._shade(eye, rays[part], hits.of(part))
        return color

    def _things(self, hits: Hits) -> I32:
        return np.where(hits.found, self.soup.thing[hits.triangle], MISS).astype(np.int32)

    def _cast(self, eye_x_mm: float, places: F32) -> tuple[F32, Hits]:
        rays = self._rays(places)
        return rays, self.caster.first_hits(np.array([eye_x_mm, 0, 0], np.float32), rays)

    def _rays(self, places: F32) -> F32:
        """Directions (N, 3) with z = 1 through image places (N, 2)."""
        c = self.calibration
        tangent = (places - np.array([c.cx_px, c.cy_px], np.float32)) / np.float32(c.focal_px)
        return np.concatenate([tangent, np.ones((len(places), 1), np.float32)], axis=1)

    def _geometry(self, hits: Hits, region: Region) -> tuple[F32, npt.NDArray[np.int16]]:
        shape = (region.height, region.width)
        depth_mm = np.where(hits.found, hits.distance, np.inf).reshape(shape)
        fruitlet = np.where(hits.found, self.soup.fruitlet[hits.triangle], -1).reshape(shape)
        return depth_mm.astype(np.float32), fruitlet.astype(np.int16)

    def _shade(self, eye: F32, rays: F32, hits: Hits) -> F32:
        soup, triangle, weights = self.soup, hits.triangle, hits.weights
        corners = soup.triangles[triangle]

        def at(values: F32) -> F32:
            return np.asarray(
                values[corners[:, 0]] * weights[:, :1]
                + values[corners[:, 1]] * weights[:, 1:2]
                + values[corners[:, 2]] * weights[:, 2:]
            )

        normals = unit(at(soup.normals))
        part, thing = soup.part[triangle], soup.thing[triangle]
        albedo = reflectance(
            at(soup.albedo), at(soup.local), part, thing, self.scene.style, self._tag
        )
        toward = -unit(rays)
        points = eye + rays * hits.distance[:, None]
        return self.light.shade(
            self.caster, points, normals, toward, albedo, part, soup.gloss[triangle]
        )


def _pixel_centres(region: Region) -> F32:
    """Image places (N, 2) as x, y of a window's pixels, row by row."""
    rows, columns = np.mgrid[region.y0 : region.y1, region.x0 : region.x1].astype(np.float32)
    return np.stack([columns.ravel(), rows.ravel()], axis=-1)


def _outlines(thing: I32) -> npt.NDArray[np.bool_]:
    """Pixels beside a change of thing."""
    edge = np.zeros(thing.shape, bool)
    across = thing[:, 1:] != thing[:, :-1]
    down = thing[1:] != thing[:-1]
    edge[:, 1:] |= across
    edge[:, :-1] |= across
    edge[1:] |= down
    edge[:-1] |= down
    return edge
