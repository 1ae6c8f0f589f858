"""What lies far behind the fruit of a drawn window: foliage, grass, sky and posts.

Nothing here is labelled. By day the distance is as sharp and as busy as what is
near, and pale specks in it look like small fruit; at night only the flash lights it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from export.drawn_objects import F32, Colour, rgb_of

SUBPIXEL_BITS = 4
SPECK_RADIUS_PX = (1.5, 9.0)
"""Smaller than any labelled fruit of a drawn window."""


@dataclass(frozen=True, slots=True)
class Distance:
    """How the far side of one window looks."""

    daylight: bool
    leaf_hue: float
    leaf_saturation: float
    brightness: float
    """Of a leaf that the light meets, 0 to 1."""

    @classmethod
    def draw(cls, daylight: bool, leaf_hue: float, rng: np.random.Generator) -> Distance:
        bright = rng.uniform(0.3, 1.0) if daylight else rng.uniform(0.02, 0.25)
        return cls(daylight, leaf_hue, float(rng.uniform(0.1, 0.6)), float(bright))

    def green(self, rng: np.random.Generator) -> Colour:
        """One leaf's colour, in the sun or in the shade."""
        value = self.brightness * float(np.exp(rng.normal(-0.3, 0.5)))
        hue, pale = self.leaf_hue + rng.normal(0, 12), float(rng.uniform(0.4, 1.3))
        return rgb_of(hue, float(np.clip(self.leaf_saturation * pale, 0, 1)), min(value, 1.0))


def draw_backdrop(side: int, distance: Distance, rng: np.random.Generator) -> F32:
    """(side, side, 3) RGB, 0 to 255."""
    image = _gradient(side, distance, rng)
    layers: list[tuple[float, Callable[[F32, Distance, np.random.Generator], None]]] = [
        (0.7, _foliage), (0.35, _grass), (0.4, _posts), (0.6, _foliage), (0.6, _specks),
    ]  # fmt: skip
    for share, layer in layers:
        if rng.random() < share:
            layer(image, distance, rng)
            image = _softened(image, float(np.exp(rng.uniform(-2.0, 0.9))))
    if distance.daylight and rng.random() < 0.4:
        image = _haze(image, rng)
    if rng.random() < (0.3 if distance.daylight else 0.7):
        image = _softened(image, float(rng.uniform(1.5, 9.0)))
    return image


def _gradient(side: int, distance: Distance, rng: np.random.Generator) -> F32:
    """Sky above and soil below, or one dark tone."""
    base = distance.green(rng)
    if distance.daylight and rng.random() < 0.5:
        base = rgb_of(rng.uniform(20, 230), rng.uniform(0, 0.25), rng.uniform(0.5, 1.3))
    cells = rng.standard_normal((12, 12, 1), dtype=np.float32) * rng.uniform(0.05, 0.4) + 1.0
    tone = cv2.resize(cells, (side, side), interpolation=cv2.INTER_CUBIC)[..., None]
    return np.asarray(np.clip(base * np.clip(tone, 0.1, 3), 0, 255), np.float32)


def _foliage(image: F32, distance: Distance, rng: np.random.Generator) -> None:
    """Many small leaves; where they are thin, what is behind shows through."""
    side = len(image)
    dense = cv2.resize(rng.random((5, 5), dtype=np.float32), (side, side))
    gap = float(rng.uniform(-0.3, 0.7))
    length = float(np.exp(rng.uniform(np.log(3), np.log(22))))
    count = int(np.clip(rng.uniform(0.3, 2.0) * (side / length) ** 2, 60, 2500))
    for x, y in rng.uniform(0, side, (count, 2)):
        if dense[int(y), int(x)] > gap:
            axes = length * rng.uniform(0.4, 1.3), length * rng.uniform(0.15, 0.6)
            _ellipse(image, (x, y), axes, float(rng.uniform(0, 180)), distance.green(rng))


def _grass(image: F32, distance: Distance, rng: np.random.Generator) -> None:
    """Blades that stand on the lower part of the picture."""
    side = len(image)
    top = int(side * rng.uniform(0.2, 0.9))
    reach = float(rng.uniform(8, 50))
    for _ in range(int(rng.integers(200, 900))):
        x, y = rng.uniform(0, side), rng.uniform(top, side + reach)
        tip = (int(x + rng.normal(0, 0.4) * reach), int(y - reach * rng.uniform(0.4, 1.2)))
        thick = int(rng.integers(1, 3))
        colour = distance.green(rng).tolist()
        cv2.line(image, (int(x), int(y)), tip, colour, thick, cv2.LINE_AA)


def _posts(image: F32, distance: Distance, rng: np.random.Generator) -> None:
    """Trunks, posts and wires."""
    side = len(image)
    for _ in range(int(rng.integers(1, 4))):
        x, lean = rng.uniform(0, side), rng.normal(0, 0.2) * side
        grey = rgb_of(
            rng.uniform(10, 60), rng.uniform(0, 0.4), distance.brightness * rng.uniform(0.3, 1.2)
        )
        ends = (int(x), 0), (int(x + lean), side)
        cv2.line(image, *ends, grey.tolist(), int(rng.uniform(2, 36)), cv2.LINE_AA)
    if rng.random() < 0.5:
        y = rng.uniform(0, side)
        ends = (0, int(y)), (side, int(y + rng.normal(0, 10)))
        cv2.line(image, *ends, distance.green(rng).tolist(), 1, cv2.LINE_AA)


def _specks(image: F32, distance: Distance, rng: np.random.Generator) -> None:
    """Far fruit, flowers, bright leaves and gaps of light: too small to be a fruitlet."""
    side = len(image)
    for _ in range(int(rng.integers(5, 90))):
        place = tuple(rng.uniform(0, side, 2))
        radius = float(np.exp(rng.uniform(*np.log(SPECK_RADIUS_PX))))
        value = min(distance.brightness * float(rng.uniform(0.7, 1.9)), 1.0)
        colour = rgb_of(rng.uniform(-20, 100), rng.uniform(0.0, 0.6), value)
        axes = radius, radius * float(rng.uniform(0.5, 1.0))
        turn = float(rng.uniform(0, 180))
        _ellipse(image, place, axes, turn, colour * 0.7)
        lit = place[0] - 0.2 * radius, place[1] - 0.25 * radius
        _ellipse(image, lit, (axes[0] * 0.7, axes[1] * 0.7), turn, colour)


def _ellipse(
    image: F32, centre: tuple[float, ...], axes: tuple[float, ...], turn: float, colour: Colour
) -> None:
    whole = 1 << SUBPIXEL_BITS
    middle = (round(centre[0] * whole), round(centre[1] * whole))
    half = (round(axes[0] * whole), round(axes[1] * whole))
    cv2.ellipse(image, middle, half, turn, 0, 360, colour.tolist(), -1, cv2.LINE_AA, SUBPIXEL_BITS)


def _haze(image: F32, rng: np.random.Generator) -> F32:
    """Stray light: the far side is paler than what is near."""
    veil = rgb_of(rng.uniform(40, 230), rng.uniform(0, 0.15), rng.uniform(0.7, 1.0))
    share = float(rng.uniform(0.1, 0.6))
    return np.asarray(image * (1 - share) + veil * share, np.float32)


def _softened(image: F32, sigma: float) -> F32:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32)
