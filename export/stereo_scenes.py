"""Textured layers at known disparities, drawn in both eyes: no orchard, no renderer.

They keep the network from learning only one renderer's light and surfaces. The
textures are noise, and cut-outs of photographs where there are any: single
photographs teach matching almost as well as real pairs (Watson et al., ECCV 2020).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from export.stereo_sample import Field, Image, StereoSample

ATLAS_PX = 768

TEXTURES = 24
"""Pictures that the surfaces of one set of scenes are cut from."""

PHOTOGRAPH_SHARE = 0.75
"""Of these, while there are photographs."""


@dataclass(frozen=True, slots=True, eq=False)
class _Layer:
    """One surface; its disparity is base + slope . (x, y), bulging inside an ellipse."""

    base: float
    slope: tuple[float, float]
    bulge: float
    center: tuple[float, float]
    radii: tuple[float, float]
    angle: float
    squareness: float
    """Exponent of the outline: 2 an ellipse, more a rounded rectangle; 0 covers all."""
    shift: tuple[float, float]
    texture: Image


def noise_atlas(rng: np.random.Generator) -> Image:
    """(ATLAS_PX, ATLAS_PX, 3) noise of several scales in random colours."""
    total = np.zeros((ATLAS_PX, ATLAS_PX, 3), np.float32)
    fall = rng.uniform(0.4, 1.0)
    for octave in range(8):
        side = max(2, ATLAS_PX >> (7 - octave))
        coarse = rng.normal(size=(side, side, 3)).astype(np.float32)
        coarse += 1.5 * coarse.mean(axis=2, keepdims=True)
        total += fall**octave * cv2.resize(
            coarse, (ATLAS_PX, ATLAS_PX), interpolation=cv2.INTER_CUBIC
        )
    if rng.random() < 0.4:
        total = np.abs(total)
    color = rng.uniform(40, 200, 3) + rng.normal(0, 20, 3)
    gain = rng.choice([4.0, 15.0, 35.0, 60.0]) / total.std()
    return np.asarray(np.clip(color + gain * (total - total.mean()), 0, 255), np.uint8)


def photograph_atlas(path: Path, rng: np.random.Generator) -> Image | None:
    """(ATLAS_PX, ATLAS_PX, 3) a photograph, turned and zoomed; nothing where it is damaged."""
    data = np.fromfile(path, np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_COLOR_RGB) if len(data) else None
    if image is None:
        return None
    zoom = float(np.exp(rng.uniform(np.log(0.6), np.log(2.0))))
    size = (round(image.shape[1] * zoom), round(image.shape[0] * zoom))
    way = cv2.INTER_AREA if zoom < 1 else cv2.INTER_CUBIC
    turned = np.rot90(cv2.resize(image, size, interpolation=way), int(rng.integers(4)))
    height, width = turned.shape[:2]
    y, x = (int(rng.integers(0, max(n - ATLAS_PX, 0) + 1)) for n in (height, width))
    part = np.ascontiguousarray(turned[y : y + ATLAS_PX, x : x + ATLAS_PX])
    below, beside = ATLAS_PX - part.shape[0], ATLAS_PX - part.shape[1]
    return np.asarray(cv2.copyMakeBorder(part, 0, below, 0, beside, cv2.BORDER_REFLECT), np.uint8)


def _texture(photographs: list[Path], rng: np.random.Generator) -> Image:
    if photographs and rng.random() < PHOTOGRAPH_SHARE:
        atlas = photograph_atlas(photographs[int(rng.integers(len(photographs)))], rng)
        if atlas is not None:
            return atlas
    return noise_atlas(rng)


class LayeredScenes:
    """Draws random scenes; the costly textures are made once."""

    def __init__(
        self, seed: int, textures: int = TEXTURES, photographs: list[Path] | None = None
    ) -> None:
        rng = np.random.default_rng(seed)
        self._textures = [_texture(photographs or [], rng) for _ in range(textures)]

    def draw(self, rng: np.random.Generator, size: int, search_px: float) -> StereoSample:
        """A (size, size) pair whose disparities lie mostly within +-search_px."""
        layers = self._layers(rng, size, search_px)
        left, nearest, disparity = _render(layers, size, 0)
        right, seen_by_right, _ = _render(layers, size, 1)
        matched = np.rint(np.arange(size) - disparity).astype(np.intp)
        rows = np.arange(size)[:, None]
        inside = (matched >= 0) & (matched < size)
        same = seen_by_right[rows, np.clip(matched, 0, size - 1)] == nearest
        decided = np.ones((size, size), bool)
        return StereoSample(left, right, disparity, same | ~inside, decided, ~decided)

    def _layers(self, rng: np.random.Generator, size: int, search_px: float) -> list[_Layer]:
        count = int(rng.integers(4, 26))
        spread = search_px * rng.uniform(0.3, 1.0)
        middle = rng.uniform(-0.4, 0.4) * search_px
        bases = np.sort(np.clip(middle + rng.normal(0, spread / 2, count), -search_px, search_px))
        if rng.random() < 0.3:
            bases[0] -= rng.uniform(0, 2 * search_px)
        return [self._layer(rng, size, float(base), i == 0) for i, base in enumerate(bases)]

    def _layer(self, rng: np.random.Generator, size: int, base: float, background: bool) -> _Layer:
        slant = rng.normal(0, 0.04, 2) * (rng.random() < 0.7)
        center = rng.uniform(0, size, 2)
        long = rng.uniform(0.05, 0.3) * size
        thin = rng.random() < 0.25
        short = rng.uniform(1.0, 4.0) if thin else long * rng.uniform(0.5, 1.0)
        round_ = not thin and rng.random() < 0.4
        return _Layer(
            base=base,
            slope=(float(slant[0]), float(slant[1])),
            bulge=float(rng.uniform(0.05, 0.3) * short) if round_ and not background else 0.0,
            center=(float(center[0]), float(center[1])),
            radii=(float(long), float(short)),
            angle=float(rng.uniform(0, np.pi)),
            squareness=0.0 if background else float(rng.choice([2.0, 2.0, 4.0, 10.0])),
            shift=(float(rng.uniform(64, ATLAS_PX - 64)), float(rng.uniform(64, ATLAS_PX - 64))),
            texture=self._textures[int(rng.integers(len(self._textures)))],
        )


def _render(
    layers: list[_Layer], size: int, eye: int
) -> tuple[Image, npt.NDArray[np.int16], Field]:
    """Picture, index of the visible layer, and disparity (of the left eye) of one eye."""
    picture = np.zeros((size, size, 3), np.float32)
    nearest = np.zeros((size, size), np.int16)
    disparity = np.zeros((size, size), np.float32)
    for index, layer in enumerate(layers):
        reach = size if layer.squareness == 0 else max(layer.radii) + 2
        shift = eye * layer.base
        x0, x1 = (
            int(np.clip(layer.center[0] - shift + side * (reach + 12 * eye), 0, size))
            for side in (-1, 1)
        )
        y0, y1 = (int(np.clip(layer.center[1] + side * reach, 0, size)) for side in (-1, 1))
        if layer.squareness == 0:
            x0, y0, x1, y1 = 0, 0, size, size
        if x1 - x0 < 1 or y1 - y0 < 1:
            continue
        window = (slice(y0, y1), slice(x0, x1))
        color, cover, moved = _paint(layer, (x0, y0, x1, y1), eye)
        picture[window] += cover[..., None] * (color - picture[window])
        inside = cover > 0.5
        nearest[window][inside] = index
        disparity[window][inside] = moved[inside]
    return np.clip(picture, 0, 255).astype(np.uint8), nearest, disparity


def _paint(
    layer: _Layer, window: tuple[int, int, int, int], eye: int
) -> tuple[Field, Field, Field]:
    """Colour, cover (0..1) and disparity of a layer in a window of one eye."""
    x0, y0, x1, y1 = window
    x, y = np.meshgrid(np.arange(x0, x1, dtype=np.float32), np.arange(y0, y1, dtype=np.float32))
    moved = _disparity_at(layer, x, y)
    if eye:
        seen = x
        for _ in range(6 if layer.bulge else 3):
            x = seen + moved
            moved = _disparity_at(layer, x, y)
        x = seen + moved
    map_x = np.clip(x - layer.center[0] + layer.shift[0], -2 * ATLAS_PX, 2 * ATLAS_PX)
    map_y = y - layer.center[1] + layer.shift[1]
    color = cv2.remap(layer.texture, map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    if layer.squareness == 0:
        return color.astype(np.float32), np.ones_like(x), moved
    radius = _radius(layer, x, y)
    edge = min(layer.radii)
    cover = np.clip((1 - radius) * edge + 0.5, 0, 1)
    shade = np.clip(1.1 - 0.5 * np.minimum(radius, 1) ** 2, 0, 1.2) if layer.bulge else 1.0
    return color * np.asarray(shade, np.float32)[..., None], cover, moved


def _radius(layer: _Layer, x: Field, y: Field) -> Field:
    """1 on the outline, less inside."""
    dx, dy = x - layer.center[0], y - layer.center[1]
    cos, sin = np.cos(layer.angle), np.sin(layer.angle)
    along = np.abs(cos * dx + sin * dy) / layer.radii[0]
    across = np.abs(cos * dy - sin * dx) / layer.radii[1]
    power = layer.squareness
    return np.asarray((along**power + across**power) ** (1 / power), np.float32)


def _disparity_at(layer: _Layer, x: Field, y: Field) -> Field:
    dx, dy = x - layer.center[0], y - layer.center[1]
    plane = layer.base + layer.slope[0] * dx + layer.slope[1] * dy
    if not layer.bulge:
        return plane.astype(np.float32)
    # A paraboloid: steep rims would fold over in the other eye.
    inside = np.clip(1 - _radius(layer, x, y) ** 2, 0, 1)
    return np.asarray(plane + layer.bulge * inside, np.float32)
