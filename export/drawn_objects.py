"""Fruit, leaves, twigs and cards drawn in two dimensions, each with a soft outline."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import Region

ImageU8 = npt.NDArray[np.uint8]
F32 = npt.NDArray[np.float32]
Colour = npt.NDArray[np.float32]
"""(3,) RGB, 0 to 255."""

SUBPIXEL_BITS = 4


@dataclass(frozen=True, slots=True, eq=False)
class Sprite:
    """A drawn thing: where it lies, what it covers, how it looks."""

    x: int
    y: int
    alpha: F32
    """(h, w) 0 to 1 coverage."""
    colour: F32
    """(h, w, 3) 0 to 255."""

    @property
    def region(self) -> Region:
        height, width = self.alpha.shape
        return Region(self.x, self.y, self.x + width, self.y + height)


@dataclass(frozen=True, slots=True)
class Light:
    """Direction towards the light and the share of light without direction."""

    x: float
    y: float
    z: float
    ambient: float


def rgb_of(hue: float, saturation: float, value: float) -> Colour:
    """(3,) RGB of a hue in degrees and two shares."""
    hsv = np.array([[[hue % 360.0, saturation, value]]], np.float32)
    rgb = cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)[0, 0] * 255.0
    return np.asarray(np.clip(rgb, 0, 255), dtype=np.float32)


def fill_outline(points: F32, margin: int = 2) -> tuple[int, int, F32]:
    """Corner and antialiased coverage of a closed outline (N, 2), pixel centres at integers.

    Drawn four times as large and averaged, so that the half-covered line lies
    on the outline to a few hundredths of a pixel.
    """
    low = np.floor(points.min(axis=0)).astype(int) - margin
    high = np.ceil(points.max(axis=0)).astype(int) + margin + 1
    width, height = np.minimum(high - low, 900)
    zoom = 4
    # Centre of pixel p is sub-pixel index zoom * p + (zoom - 1) / 2.
    scaled = (points - low) * zoom + (zoom - 1) / 2
    fixed = np.round(scaled * (1 << SUBPIXEL_BITS)).astype(np.int32)
    canvas = np.zeros((height * zoom, width * zoom), np.uint8)
    cv2.fillPoly(canvas, [fixed], 255, lineType=cv2.LINE_8, shift=SUBPIXEL_BITS)
    # fillPoly fills the border line whole, half a sub-pixel too far: count it half.
    cv2.polylines(canvas, [fixed], True, 128, lineType=cv2.LINE_8, shift=SUBPIXEL_BITS)
    small = cv2.resize(canvas, (int(width), int(height)), interpolation=cv2.INTER_AREA)
    return int(low[0]), int(low[1]), small.astype(np.float32) / 255.0


def _grain(shape: tuple[int, int], cell: float, rng: np.random.Generator) -> F32:
    """(h, w) smooth noise with a standard deviation of about 1."""
    cells = (max(2, int(shape[0] / cell)), max(2, int(shape[1] / cell)))
    small = rng.standard_normal(cells, dtype=np.float32)
    return np.asarray(
        cv2.resize(small, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC), dtype=np.float32
    )


def _grid(x: int, y: int, shape: tuple[int, int]) -> tuple[F32, F32]:
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]].astype(np.float32)
    return columns + x, rows + y


@dataclass(frozen=True, slots=True)
class FruitLook:
    """Material of one fruit."""

    hue: float
    saturation: float
    value: float
    blush: float
    gloss: float
    roughness: float


def fruit_outline(
    centre: tuple[float, float], long: float, short: float, angle: float, rng: np.random.Generator
) -> F32:
    """(96, 2) slightly irregular ellipse with half axes `long` and `short`."""
    turn = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    radius = np.ones_like(turn)
    for order in (2, 3, 4, 5):
        size = rng.normal(0, 0.02 / order)
        radius += size * np.cos(order * turn + rng.uniform(0, 2 * np.pi))
    along, across = radius * long * np.cos(turn), radius * short * np.sin(turn)
    x = centre[0] + along * np.cos(angle) - across * np.sin(angle)
    y = centre[1] + along * np.sin(angle) + across * np.cos(angle)
    return np.stack([x, y], axis=1).astype(np.float32)


def draw_fruit(
    centre: tuple[float, float],
    long: float,
    short: float,
    angle: float,
    look: FruitLook,
    light: Light,
    rng: np.random.Generator,
) -> Sprite:
    """A shaded fruit with skin texture and, often, its calyx."""
    x, y, alpha = fill_outline(fruit_outline(centre, long, short, angle, rng))
    columns, rows = _grid(x, y, alpha.shape)
    dx, dy = columns - centre[0], rows - centre[1]
    along = (dx * np.cos(angle) + dy * np.sin(angle)) / long
    across = (-dx * np.sin(angle) + dy * np.cos(angle)) / short
    height = np.sqrt(np.clip(1.0 - along**2 - across**2, 0.0, 1.0))
    # The outline's normal lies along the gradient of the ellipse, not the radius.
    nx = along * np.cos(angle) - across * np.sin(angle)
    ny = along * np.sin(angle) + across * np.cos(angle)
    lit = np.clip(nx * light.x + ny * light.y + height * light.z, 0, 1)
    rim = rng.uniform(0.45, 0.95)
    shade = light.ambient * (rim + (1 - rim) * height) + (1 - light.ambient) * lit
    base = _skin(alpha.shape, along, across, look, rng)
    colour = base * shade[..., None]
    half = np.array([light.x, light.y, light.z + 1.0])
    half /= np.linalg.norm(half)
    glint = np.clip(nx * half[0] + ny * half[1] + height * half[2], 0, 1) ** look.roughness
    colour += (look.gloss * 255.0 * glint)[..., None]
    if rng.random() < 0.6:
        _calyx(colour, along, across, min(long, short), rng)
    return Sprite(x, y, alpha, np.clip(colour, 0, 255).astype(np.float32))


def _skin(
    shape: tuple[int, int], along: F32, across: F32, look: FruitLook, rng: np.random.Generator
) -> F32:
    base = rgb_of(look.hue, look.saturation, look.value)
    red = rgb_of(rng.uniform(-10, 25), min(1.0, look.saturation + 0.25), look.value * 0.9)
    side = rng.uniform(0, 2 * np.pi)
    toward = along * np.cos(side) + across * np.sin(side)
    share = np.clip(look.blush * (0.5 + toward + 0.25 * _grain(shape, 6, rng)), 0, 1)[..., None]
    colour = base * (1 - share) + red * share
    colour = colour * (1.0 + 0.05 * _grain(shape, 4, rng)[..., None])
    if rng.random() < 0.5:
        dots = rng.random(shape) < 0.02
        colour[dots] = colour[dots] * 0.6 + 90.0
    return np.asarray(colour, dtype=np.float32)


def _calyx(colour: F32, along: F32, across: F32, radius: float, rng: np.random.Generator) -> None:
    """A dark, star-like flower remainder somewhere on the visible side."""
    far, side = rng.uniform(0.1, 0.95), rng.uniform(0, 2 * np.pi)
    px, py = along - far * np.cos(side), across - far * np.sin(side)
    reach = np.hypot(px, py)
    spikes = 1.0 + 0.5 * np.cos(5 * np.arctan2(py, px) + rng.uniform(0, 6))
    size = rng.uniform(0.08, 0.3)
    share = np.clip((size * spikes - reach) / (1.5 / max(radius, 4.0)), 0, 1)[..., None]
    tone = rgb_of(rng.uniform(20, 90), rng.uniform(0.2, 0.6), rng.uniform(0.1, 0.5))
    colour *= 1 - share
    colour += tone * share


def _leaf_outline(
    root: tuple[float, float], length: float, width: float, angle: float, rng: np.random.Generator
) -> F32:
    share = np.linspace(0, 1, 24)
    profile = np.sin(np.pi * share ** rng.uniform(0.7, 1.1)) ** rng.uniform(0.8, 1.2)
    teeth = 1 + rng.uniform(0, 0.08) * np.sin(share * rng.uniform(40, 90))
    bend = rng.normal(0, 0.18) * share**2
    up = bend + 0.5 * width * profile * teeth * rng.uniform(0.4, 1.0)
    down = bend - 0.5 * width * profile * teeth * rng.uniform(0.4, 1.0)
    along = np.concatenate([share, share[::-1]]) * length
    across = np.concatenate([up, down[::-1]]) * length
    x = root[0] + along * np.cos(angle) - across * np.sin(angle)
    y = root[1] + along * np.sin(angle) + across * np.cos(angle)
    return np.stack([x, y], axis=1).astype(np.float32)


def draw_leaf(
    root: tuple[float, float], length: float, colour: Colour, rng: np.random.Generator
) -> Sprite:
    """A leaf with midrib, side veins and a bright and a dark half."""
    angle = rng.uniform(0, 2 * np.pi)
    outline = _leaf_outline(root, length, rng.uniform(0.25, 0.75), angle, rng)
    x, y, alpha = fill_outline(outline)
    columns, rows = _grid(x, y, alpha.shape)
    dx, dy = (columns - root[0]) / length, (rows - root[1]) / length
    along = dx * np.cos(angle) + dy * np.sin(angle)
    across = -dx * np.sin(angle) + dy * np.cos(angle)
    tone = 1.0 + rng.uniform(-0.3, 0.3) * np.tanh(across * 12) + rng.uniform(-0.4, 0.4) * along
    tone += 0.08 * _grain(alpha.shape, length / 6, rng)
    veins = np.exp(-((across * length / 1.5) ** 2))
    ribs = np.abs(np.sin((along - np.abs(across) * 0.8) * rng.uniform(18, 34))) < 0.12
    tone += rng.uniform(-0.15, 0.35) * veins + rng.uniform(-0.05, 0.12) * ribs
    shaded = colour * np.clip(tone, 0.05, 2.0)[..., None]
    return Sprite(x, y, alpha, np.clip(shaded, 0, 255).astype(np.float32))


def draw_twig(points: F32, thickness: float, colour: Colour, rng: np.random.Generator) -> Sprite:
    """A stem or twig along a line of points (N, 2), round in section."""
    ahead = np.gradient(points, axis=0)
    normal = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-6)
    taper = np.linspace(1.0, rng.uniform(0.6, 1.2), len(points))[:, None] * thickness / 2
    outline = np.concatenate([points + normal * taper, (points - normal * taper)[::-1]])
    x, y, alpha = fill_outline(outline.astype(np.float32))
    depth = cv2.distanceTransform((alpha > 0.5).astype(np.uint8), cv2.DIST_L2, 3)
    tone = 0.55 + 0.6 * np.clip(depth / max(thickness / 2, 1.0), 0, 1)
    tone = tone * (1.0 + 0.12 * _grain(alpha.shape, 5, rng))
    return Sprite(x, y, alpha, np.clip(colour * tone[..., None], 0, 255).astype(np.float32))


def draw_card(centre: tuple[float, float], side: float, rng: np.random.Generator) -> Sprite:
    """A hanging white card with a black and white grid like a tag's."""
    cells = rng.integers(0, 2, (8, 8)).astype(np.float32)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = 0, 0, 0, 0
    pattern = np.pad(cells, 1, constant_values=1.0)
    texture = cv2.resize(pattern, (160, 160), interpolation=cv2.INTER_NEAREST)
    angle = rng.normal(0, 0.25)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    tilt = np.array([rng.uniform(0.7, 1.0), rng.uniform(0.8, 1.0)])
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * tilt * side / 2
    corners = (square @ turn.T + centre + rng.normal(0, side * 0.02, (4, 2))).astype(np.float32)
    x, y, alpha = fill_outline(corners)
    source = np.array([[0, 0], [159, 0], [159, 159], [0, 159]], np.float32)
    warp = cv2.getPerspectiveTransform(source, corners - np.array([x, y], np.float32))
    size = (alpha.shape[1], alpha.shape[0])
    drawn = cv2.warpPerspective(texture, warp, size, borderMode=cv2.BORDER_REPLICATE)
    dark, bright = rng.uniform(5, 50), rng.uniform(130, 255)
    value = dark + (bright - dark) * np.asarray(drawn)
    return Sprite(x, y, alpha, np.repeat(value[..., None], 3, axis=2).astype(np.float32))
