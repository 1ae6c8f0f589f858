"""Training windows drawn in two dimensions, for what rendered orchards lack.

Night with flash, and daylight with green clutter, fruit of the leaves' colour
and crowds. Each window is a shard with `image`, `labels` and `whole`:

    python -m export.drawn_crops --out DIR --count 1200 --seed 1
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from export.drawn_backdrops import Distance, draw_backdrop
from export.drawn_objects import (
    F32,
    Colour,
    FruitLook,
    Light,
    Sprite,
    draw_card,
    draw_fruit,
    draw_leaf,
    draw_twig,
    rgb_of,
)
from export.segmentation_window import Window
from fieldcam.values import Region

WINDOW_PX = 512
MAX_FRUIT = 60


@dataclass(slots=True, eq=False)
class Canvas:
    """The picture while it is painted, far things first."""

    image: F32
    labels: npt.NDArray[np.uint8]
    front: npt.NDArray[np.bool_]
    """(H, W) what was painted over the backdrop."""
    whole: list[npt.NDArray[np.bool_]] = field(default_factory=list)

    @property
    def side(self) -> int:
        """Pixels of one side."""
        return len(self.image)

    @property
    def region(self) -> Region:
        return Region.whole(self.side, self.side)

    def shadow(self, sprite: Sprite, dx: int, dy: int, depth: float) -> None:
        """Darkens what lies behind a sprite, beside it."""
        soft = cv2.GaussianBlur(np.pad(sprite.alpha, 6), (0, 0), 2.5)
        cast = Sprite(sprite.x - 6 + dx, sprite.y - 6 + dy, np.asarray(soft), sprite.colour)
        seen = cast.region.overlap(self.region)
        self.image[seen.slices] *= 1.0 - depth * cast.alpha[seen.slices_in(cast.region)][..., None]

    def paint(self, sprite: Sprite, fruit: bool = False) -> None:
        """Lays a sprite over the picture; a fruit gets the next label."""
        seen = sprite.region.overlap(self.region)
        shown = seen.slices_in(sprite.region)
        alpha = sprite.alpha[shown]
        area = self.image[seen.slices]
        area += (sprite.colour[shown] - area) * alpha[..., None]
        covered = alpha > 0.5
        if fruit and covered.any():
            outline = np.zeros(self.labels.shape, bool)
            outline[seen.slices] = covered
            self.whole.append(outline)
        label = len(self.whole) if fruit else 0
        self.labels[seen.slices][covered] = label
        self.front[seen.slices] |= covered

    def window(self) -> Window:
        """The finished picture."""
        image = np.clip(self.image, 0, 255).astype(np.uint8)
        shape = (0, *self.labels.shape)
        whole = np.stack(self.whole) if self.whole else np.zeros(shape, bool)
        return Window(image, self.labels, whole)


@dataclass(frozen=True, slots=True)
class Scene:
    """What one window is about."""

    daylight: bool
    light: Light
    leaf_hue: float
    leaf_saturation: float
    leaf_value: float
    fruit: FruitLook
    radius: float
    count: int


def _light(daylight: bool, rng: np.random.Generator) -> Light:
    tilt = rng.uniform(0.3, 1.1) if daylight else rng.uniform(0.0, 0.35)
    side = rng.uniform(0, 2 * np.pi) if not daylight else rng.normal(-np.pi / 2, 0.9)
    ambient = rng.uniform(0.3, 0.95) if daylight else rng.uniform(0.05, 0.35)
    return Light(
        float(np.sin(tilt) * np.cos(side)),
        float(np.sin(tilt) * np.sin(side)),
        float(np.cos(tilt)),
        float(ambient),
    )


def random_scene(rng: np.random.Generator) -> Scene:
    """Season, hour and crowding of one window."""
    daylight = bool(rng.random() < 0.55)
    leaf_hue = rng.uniform(70, 135)
    similar = rng.random() < 0.6
    hue = leaf_hue + rng.normal(-8, 14) if similar else rng.uniform(-15, 120)
    grey = 1.0 if daylight else rng.uniform(0.15, 1.0)
    look = FruitLook(
        hue=hue,
        saturation=float(rng.uniform(0.08, 0.8) * grey),
        value=float(rng.uniform(0.45, 1.0)),
        blush=float(rng.uniform(0, 0.9) if rng.random() < (0.5 if daylight else 0.3) else 0.0),
        gloss=float(rng.uniform(0.0, 0.6)),
        roughness=float(np.exp(rng.uniform(2.0, 5.0))),
    )
    radius = float(np.exp(rng.uniform(np.log(11), np.log(78))))
    crowd = int(rng.integers(8, 40)) if radius < 28 else int(rng.integers(3, 14))
    return Scene(
        daylight,
        _light(daylight, rng),
        leaf_hue,
        float(rng.uniform(0.2, 0.8) * max(grey, 0.4)),
        float(rng.uniform(0.25, 0.85)),
        look,
        radius,
        0 if rng.random() < 0.06 else crowd,
    )


def _leaf_colour(scene: Scene, dim: float, rng: np.random.Generator) -> Colour:
    return rgb_of(
        scene.leaf_hue + rng.normal(0, 8),
        float(np.clip(scene.leaf_saturation * rng.uniform(0.6, 1.3), 0, 1)),
        float(np.clip(scene.leaf_value * dim * rng.uniform(0.4, 1.5), 0.02, 1)),
    )


def _spot(rng: np.random.Generator) -> tuple[float, float]:
    x, y = rng.uniform(-30, WINDOW_PX + 30, 2)
    return float(x), float(y)


def _paint_leaf(canvas: Canvas, scene: Scene, rng: np.random.Generator) -> None:
    least = float(rng.uniform(25, 120))
    length = float(np.clip(scene.radius * rng.uniform(1.2, 5.0), least, 330))
    leaf = draw_leaf(_spot(rng), length, _leaf_colour(scene, 1.0, rng), rng)
    if rng.random() < 0.6:
        dx, dy = rng.integers(-6, 7, 2)
        canvas.shadow(leaf, int(dx), int(dy), float(rng.uniform(0.2, 0.6)))
    canvas.paint(leaf)


def _line(start: tuple[float, float], end: tuple[float, float], rng: np.random.Generator) -> F32:
    share = np.linspace(0, 1, 20)[:, None]
    a, b = np.array(start), np.array(end)
    bend = rng.normal(0, 0.15, 2) * np.linalg.norm(b - a)
    line = a + (b - a) * share + bend * np.sin(np.pi * share)
    return np.asarray(line, dtype=np.float32)


def _paint_twig(canvas: Canvas, scene: Scene, rng: np.random.Generator) -> None:
    thickness = float(rng.uniform(3, 14) if rng.random() < 0.8 else rng.uniform(15, 50))
    colour = rgb_of(rng.uniform(10, 70), rng.uniform(0.05, 0.5), rng.uniform(0.15, 0.7))
    twig = draw_twig(_line(_spot(rng), _spot(rng), rng), thickness, colour, rng)
    canvas.paint(twig)


def _fruit_spots(scene: Scene, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Centres in a few bunches that touch and overlap."""
    spots: list[tuple[float, float]] = []
    while len(spots) < scene.count:
        x, y = rng.uniform(0, WINDOW_PX, 2)
        for _ in range(int(rng.integers(1, 9))):
            spread = scene.radius * rng.uniform(0.8, 2.0)
            spots.append((float(x + rng.normal(0, spread)), float(y + rng.normal(0, spread))))
    return spots[: min(scene.count, MAX_FRUIT)]


def _one_look(scene: Scene, rng: np.random.Generator) -> FruitLook:
    base = scene.fruit
    return FruitLook(
        base.hue + float(rng.normal(0, 5)),
        float(np.clip(base.saturation * rng.uniform(0.8, 1.2), 0, 1)),
        float(np.clip(base.value * rng.uniform(0.45 if scene.daylight else 0.7, 1.15), 0.1, 1)),
        base.blush * float(rng.uniform(0.4, 1.2)),
        base.gloss,
        base.roughness,
    )


def _paint_fruit(
    canvas: Canvas, spot: tuple[float, float], scene: Scene, rng: np.random.Generator
) -> None:
    long = scene.radius * float(np.clip(rng.normal(1, 0.15), 0.5, 1.5))
    short = long * float(rng.uniform(0.72, 1.0))
    angle = float(rng.uniform(0, np.pi))
    green = _leaf_colour(scene, 1.2, rng)
    if rng.random() < 0.7:
        reach = rng.normal(0, 2.5 * scene.radius, 2)
        end = (spot[0] + float(reach[0]), spot[1] + float(reach[1]))
        stem = draw_twig(_line(spot, end, rng), max(1.5, long * 0.13), green, rng)
        canvas.paint(stem)
    fruit = draw_fruit(spot, long, short, angle, _one_look(scene, rng), scene.light, rng)
    if rng.random() < 0.75:
        dx, dy = rng.integers(-5, 6, 2)
        canvas.shadow(fruit, int(dx), int(dy), float(rng.uniform(0.15, 0.6)))
    canvas.paint(fruit, fruit=True)
    if rng.random() < 0.3:
        _paint_sepals(canvas, spot, long, green, rng)


def _paint_sepals(
    canvas: Canvas,
    spot: tuple[float, float],
    radius: float,
    colour: Colour,
    rng: np.random.Generator,
) -> None:
    """Flower remains that stick out over the outline; they are not fruit."""
    side = rng.uniform(0, 2 * np.pi)
    root = (spot[0] + radius * float(np.cos(side)), spot[1] + radius * float(np.sin(side)))
    tone = colour * float(rng.uniform(0.4, 1.2))
    for _ in range(int(rng.integers(1, 4))):
        canvas.paint(draw_leaf(root, max(4.0, radius * rng.uniform(0.2, 0.5)), tone, rng))


def draw_window(rng: np.random.Generator) -> Window:
    """One random window."""
    return draw_canvas(rng).window()


def draw_canvas(rng: np.random.Generator) -> Canvas:
    """One random window with its front."""
    scene = random_scene(rng)
    distance = Distance.draw(scene.daylight, scene.leaf_hue, rng)
    backdrop = draw_backdrop(WINDOW_PX, distance, rng)
    shape = (WINDOW_PX, WINDOW_PX)
    canvas = Canvas(backdrop, np.zeros(shape, np.uint8), np.zeros(shape, bool))
    leaves = int(rng.integers(3, 110 if scene.daylight else 40))
    for _ in range(leaves):
        _paint_leaf(canvas, scene, rng)
    for _ in range(int(rng.integers(0, 5))):
        _paint_twig(canvas, scene, rng)
    if rng.random() < 0.3:
        canvas.paint(draw_card(_spot(rng), float(rng.uniform(60, 170)), rng))
    between = rng.uniform(0, 0.5)
    for spot in _fruit_spots(scene, rng):
        _paint_fruit(canvas, spot, scene, rng)
        if rng.random() < between:
            _paint_leaf(canvas, scene, rng)
    for _ in range(int(rng.integers(0, 4))):
        (_paint_leaf if rng.random() < 0.7 else _paint_twig)(canvas, scene, rng)
    return canvas


def save_canvas(canvas: Canvas, path: Path) -> None:
    """Writes a shard under a temporary name, then renames it."""
    window = canvas.window()
    part = path.with_suffix(".part")
    with part.open("wb") as stream:
        np.savez_compressed(
            stream,
            image=window.image,
            labels=window.labels,
            whole=np.packbits(window.whole, axis=-1),
            front=np.packbits(canvas.front, axis=-1),
        )
    part.replace(path)


def main(argv: list[str] | None = None) -> int:
    """Writes `--count` windows of consecutive seeds; those present stay."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, default=1200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(argv)
    cv2.setNumThreads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    for number in range(options.seed, options.seed + options.count):
        path = options.out / f"{number}.npz"
        if not path.exists():
            save_canvas(draw_canvas(np.random.default_rng((7, number))), path)
    sys.stderr.write(f"{options.count} drawn windows in {options.out}\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
