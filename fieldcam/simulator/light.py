"""Flash lamps beside the lenses, weak daylight, and what lies far behind."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.simulator.mesh import F32, MeshPart, unit
from fieldcam.simulator.raycast import RayCaster

REFERENCE_MM = 440.0
"""Range at which a lamp's strength is stated."""


@dataclass(frozen=True, slots=True, eq=False)
class Sun:
    """A far light, equally strong everywhere that it reaches."""

    place_mm: F32
    """(3,) in the left eye's frame, some metres away."""
    strength: float


@dataclass(frozen=True, slots=True, eq=False)
class SceneLight:
    """All light of one exposure; strengths are linear, 1 lights white paper fully."""

    lamps_mm: F32
    """(L, 3) in the left eye's frame."""
    lamp_strength: float
    lamp_color: F32
    sky: F32
    """(3,) daylight from above."""
    ground: F32
    """(3,) daylight from below."""
    backdrop: F32
    """(h, w, 3) what is seen where nothing is hit, over the whole field of view."""
    sun: Sun | None = None

    @classmethod
    def draw(cls, rng: np.random.Generator, baseline_mm: float, flash: float = 1.0) -> SceneLight:
        """Draw the light of one exposure; `flash` scales the lamps."""
        spread = rng.uniform(35, 110)
        height = rng.normal(0, 25)
        soft = rng.uniform(4, 14)
        left, right = -spread, baseline_mm + spread
        lamps = np.array(
            [
                [x + s * soft, height + s * soft, rng.uniform(-25, 5)]
                for x in (left, right)
                for s in (-1, 1)
            ],
            np.float32,
        )
        daylight = float(
            rng.choice([0.0, rng.uniform(0.01, 0.08), rng.uniform(0.08, 0.5)], p=[0.3, 0.5, 0.2])
        )
        tint = rng.normal(0, 0.12, 3)
        return cls(
            lamps_mm=lamps,
            lamp_strength=flash * rng.uniform(0.8, 1.2),
            lamp_color=np.exp(rng.normal(0, 0.05, 3)).astype(np.float32),
            sky=(daylight * np.exp(tint + np.array([-0.1, 0, 0.15]))).astype(np.float32),
            ground=(0.4 * daylight * np.exp(tint + np.array([0, 0.15, -0.2]))).astype(np.float32),
            backdrop=_backdrop(rng, daylight),
        )

    def shade(
        self, caster: RayCaster, points_mm: F32, normals: F32, toward_eye: F32, albedo: F32,
        part: npt.NDArray[np.uint8], gloss: F32,
    ) -> F32:  # fmt: skip
        """Light leaving points (N, 3) towards the eye, linear RGB (N, 3)."""
        facing = np.einsum("ij,ij->i", normals, toward_eye)
        outward = np.where(facing[:, None] < 0, -normals, normals)
        up = (0.5 - 0.5 * outward[:, 1])[:, None]
        diffuse = self.sky * up + self.ground * (1 - up)
        shine = np.zeros(len(points_mm), np.float32)
        thin = np.where(part == MeshPart.LEAF, np.float32(0.35), np.float32(0))
        lights = [*self.lamps_mm, *([self.sun.place_mm] if self.sun else [])]
        for lamp in lights:
            path = unit(lamp - points_mm)
            cosine = np.einsum("ij,ij->i", outward, path)
            lit = np.where(cosine > 0, cosine, -thin * cosine)
            lit *= self._arriving(caster, lamp, points_mm, lit > 0)
            diffuse += lit[:, None] * self.lamp_color
            glossy = np.flatnonzero((gloss > 0) & (cosine > 0) & (lit > 0))
            half = unit(path[glossy] + toward_eye[glossy])
            spark = np.einsum("ij,ij->i", half, outward[glossy]).clip(0, 1) ** 40
            shine[glossy] += spark * gloss[glossy] * lit[glossy]
        return np.asarray(albedo * diffuse + 0.6 * shine[:, None] * self.lamp_color, np.float32)

    def _arriving(
        self, caster: RayCaster, lamp_mm: F32, points_mm: F32, facing: npt.NDArray[np.bool_]
    ) -> F32:
        """Strength of one light at points (N, 3); 0 in shadow or turned away."""
        chosen = np.flatnonzero(facing)
        if self.sun is not None and lamp_mm is self.sun.place_mm:
            bright = np.full(len(chosen), self.sun.strength, np.float32)
        else:
            path = lamp_mm - points_mm[chosen]
            squared = np.einsum("ij,ij->i", path, path).clip(60.0**2)
            bright = self.lamp_strength / len(self.lamps_mm) * REFERENCE_MM**2 / squared
        arriving = np.zeros(len(points_mm), np.float32)
        arriving[chosen] = np.where(caster.blocked(points_mm[chosen], lamp_mm), 0, bright)
        return arriving

    def far(self, tangent: F32) -> F32:
        """The backdrop (N, 3) in directions given as tangents x/z and y/z (N, 2)."""
        height, width = self.backdrop.shape[:2]
        x = ((tangent[:, 0] / 0.9 + 0.5) * (width - 1)).astype(np.float32)
        y = ((tangent[:, 1] / 0.9 + 0.5) * (height - 1)).astype(np.float32)
        rows = 30_000
        parts = [
            cv2.remap(self.backdrop, x[i : i + rows, None], y[i : i + rows, None], cv2.INTER_LINEAR,
                      borderMode=cv2.BORDER_REFLECT)[:, 0]
            for i in range(0, len(x), rows)
        ]  # fmt: skip
        return (
            np.asarray(np.concatenate(parts), np.float32) if parts else np.zeros((0, 3), np.float32)
        )


def _backdrop(rng: np.random.Generator, daylight: float) -> F32:
    """Far trees, sky and grass: dark at night, bright by day; blurred, more or less."""
    side = 400
    layers = np.zeros((side, side, 1), np.float32)
    for cells, weight in ((4, 1.0), (9, 0.7), (22, 0.5), (50, 0.3)):
        coarse = rng.normal(0, weight, (cells, cells)).astype(np.float32)
        layers[..., 0] += cv2.resize(coarse, (side, side), interpolation=cv2.INTER_CUBIC)
    leaves = np.array([0.16, 0.22, 0.10], np.float32) * np.exp(rng.normal(0, 0.25, 3))
    sky = np.array([0.75, 0.85, 1.0], np.float32) * rng.uniform(0.5, 1.6)
    open_sky = 1 / (1 + np.exp(-6 * (layers - rng.uniform(0.2, 2.5))))
    scene = (leaves * np.exp(0.35 * layers) * (1 - open_sky) + sky * open_sky).astype(np.float32)
    _dab(rng, scene, leaves, int(rng.choice([0, 400, 2500])), (1.5, 6.0))
    _dab(rng, scene, leaves + 0.25 * sky, int(rng.integers(0, 80)), (0.7, 3.0))
    scene = cv2.GaussianBlur(scene, (0, 0), float(rng.uniform(0.4, 4.0)))
    brightness = daylight * rng.uniform(0.5, 2.0) + rng.uniform(0, 0.01)
    return np.asarray(scene * brightness, np.float32)


def _dab(
    rng: np.random.Generator, scene: F32, color: F32, count: int, sizes_px: tuple[float, float]
) -> None:
    """Far leaves and specks of light on a backdrop."""
    places = rng.uniform(0, scene.shape[0], (count, 2)).astype(np.int32)
    halves = rng.uniform(*sizes_px, (count, 2)).round().astype(np.int32)
    colors = color * np.exp(rng.normal(0, 0.6, (count, 1)) + rng.normal(0, 0.15, (count, 3)))
    turns = rng.uniform(0, 180, count)
    for place, half, turn, paint in zip(
        places.tolist(), halves.tolist(), turns.tolist(), colors.tolist(), strict=True
    ):
        cv2.ellipse(scene, place, half, turn, 0, 360, paint, -1, cv2.LINE_AA)
