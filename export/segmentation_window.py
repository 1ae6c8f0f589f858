"""Pictures with fruit that is known by masks, by boxes or not at all, and crops of them.

Boxes are in pixel-edge coordinates: pixel i covers i to i + 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

ImageU8 = npt.NDArray[np.uint8]
F32 = npt.NDArray[np.float32]

MIN_VISIBLE_PX = 25.0
MIN_VISIBLE_SHARE = 0.15
MIN_BOX_SHARE = 0.45
"""A box of which a crop's border leaves less is neither fruit nor background there."""
FRUIT_SHARE = 0.85
"""Share of crops that are placed on a fruit."""


def no_boxes() -> F32:
    """(0, 4)."""
    return np.zeros((0, 4), np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """One picture with its fruit: what has a mask, what has a box alone, what is unknown."""

    image: ImageU8
    """(H, W, 3) RGB."""
    labels: npt.NDArray[np.uint8]
    """(H, W) 0 none, k the visible pixels of fruitlet k."""
    whole: npt.NDArray[np.bool_]
    """(K, H, W) silhouettes, hidden part included."""
    boxes: F32 = field(default_factory=no_boxes)
    """(B, 4) fruit of which only the box is known."""
    unknown: F32 = field(default_factory=no_boxes)
    """(U, 4) places that may or may not be fruit."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One training crop, before it becomes tensors."""

    image: ImageU8
    masks: npt.NDArray[np.uint8]
    """(K, 2, H, W) 0 to 255: visible part, whole fruitlet; of the first K boxes."""
    boxes: F32
    """(N, 4) of the visible part; those left out of the loss come last."""
    certain: int
    """How many of the boxes are fruit; the others are left out of the loss."""
    hidden: npt.NDArray[np.uint8]
    """(J, 2, H, W) of fruitlets of which too little is seen; the first J left-out boxes."""


@dataclass(frozen=True, slots=True)
class CropSettings:
    """How crops are cut from windows."""

    size_px: int = 320
    min_scale: float = 0.55
    max_scale: float = 1.6


def read_window(path: Path) -> Window:
    """A rendered or drawn shard; only the arrays needed are read."""
    with np.load(path) as shard:
        image = shard["left"] if "left" in shard.files else shard["image"]
        labels = shard["labels"]
        packed = shard["whole"]
    whole = np.unpackbits(packed, axis=-1, count=labels.shape[1]).astype(bool)
    return Window(image, labels, whole)


def tight_box(mask: npt.NDArray[np.uint8]) -> tuple[int, int, int, int]:
    """x0, y0, x1, y1 in pixel edges of the cells that are at least half covered."""
    x, y, width, height = cv2.boundingRect((mask > 127).astype(np.uint8))
    return x, y, x + width, y + height


def _turn(array: npt.NDArray[np.uint8], turns: int, flip: bool) -> npt.NDArray[np.uint8]:
    turned = np.rot90(array, turns)
    return np.ascontiguousarray(turned[:, ::-1] if flip else turned)


@dataclass(frozen=True, slots=True)
class Placement:
    """Which part of a window becomes which part of a crop."""

    x: int
    y: int
    side: int
    """Pixels of the window that are cut, square."""
    out: int
    """Pixels of the crop that they fill, from the corner."""
    turns: int
    flip: bool

    def image(self, array: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        """(out, out[, 3]) antialiased."""
        cut = array[self.y : self.y + self.side, self.x : self.x + self.side]
        way = cv2.INTER_AREA if self.out < self.side else cv2.INTER_LINEAR
        resized = cv2.resize(cut, (self.out, self.out), interpolation=way)
        return _turn(np.asarray(resized, dtype=np.uint8), self.turns, self.flip)

    def boxes(self, boxes: F32) -> F32:
        """(N, 4) the same boxes in the crop, not yet cut at its border."""
        moved = (boxes - np.array([self.x, self.y] * 2, np.float32)) * (self.out / self.side)
        for _ in range(self.turns):
            x0, y0, x1, y1 = moved.T
            moved = np.stack([y0, self.out - x1, y1, self.out - x0], axis=1)
        if self.flip:
            moved = np.stack(
                [self.out - moved[:, 2], moved[:, 1], self.out - moved[:, 0], moved[:, 3]], axis=1
            )
        return np.asarray(moved, np.float32)


def _corner(focus: float, side: int, room: int, rng: np.random.Generator) -> int:
    """Start of a random span of `side` pixels out of `room` that holds `focus`."""
    low = max(0, int(focus) - side + 1)
    high = min(room - side, int(focus))
    return int(rng.integers(low, high + 1))


def _focus(window: Window, rng: np.random.Generator) -> tuple[float, float]:
    """A place on a fruit, or anywhere: x, y."""
    height, width = window.labels.shape
    fruit = np.flatnonzero(window.labels)
    spots = len(fruit) + len(window.boxes)
    if not spots or rng.random() > FRUIT_SHARE:
        return float(rng.integers(width)), float(rng.integers(height))
    if len(window.boxes) and (not len(fruit) or rng.random() < 0.5):
        x0, y0, x1, y1 = window.boxes[int(rng.integers(len(window.boxes)))]
        middle = (x0 + x1) / 2, (y0 + y1) / 2
        return float(np.clip(middle[0], 0, width - 1)), float(np.clip(middle[1], 0, height - 1))
    row, column = divmod(int(rng.choice(fruit)), width)
    return float(column), float(row)


def place(window: Window, settings: CropSettings, rng: np.random.Generator) -> Placement:
    """A random square of a window at a random scale, mostly one with fruit in it."""
    height, width = window.labels.shape
    low, high = np.log(settings.min_scale), np.log(settings.max_scale)
    scale = float(np.exp(rng.uniform(low, high)))
    side = min(round(settings.size_px / scale), height, width)
    x, y = _focus(window, rng)
    return Placement(
        x=_corner(x, side, width, rng),
        y=_corner(y, side, height, rng),
        side=side,
        out=min(round(side * scale), settings.size_px),
        turns=int(rng.integers(0, 4)),
        flip=bool(rng.integers(0, 2)),
    )


def _padded(array: npt.NDArray[np.uint8], size: int, fill: int) -> npt.NDArray[np.uint8]:
    room = size - array.shape[0]
    if room == 0:
        return array
    widths = ((0, room), (0, room), (0, 0))[: array.ndim]
    return np.pad(array, widths, constant_values=fill)


def cut(window: Window, placement: Placement, size_px: int, fill: int = 40) -> Sample:
    """The crop of a placement with its targets; where it is too small, a flat border."""
    image = _padded(placement.image(window.image), size_px, fill)
    kept, hidden = _masks(window, placement, size_px)
    certain, uncertain = _cut_boxes(placement.boxes(window.boxes), placement.out)
    _, unknown = _cut_boxes(placement.boxes(window.unknown), placement.out, least=np.inf)
    boxes = [_mask_boxes(kept), certain, _mask_boxes(hidden), uncertain, unknown]
    return Sample(image, kept, np.concatenate(boxes), len(kept) + len(certain), hidden)


def _masks(
    window: Window, placement: Placement, size_px: int
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]]:
    """Masks of fruitlets that are seen well enough, and of those that are not."""
    kept: list[npt.NDArray[np.uint8]] = []
    hidden: list[npt.NDArray[np.uint8]] = []
    zoom = (placement.out / placement.side) ** 2
    for index, whole in enumerate(window.whole, start=1):
        seen = placement.image((window.labels == index).astype(np.uint8) * 255)
        area = float(seen.sum()) / 255.0
        if seen.max() <= 127:
            continue
        outline = placement.image(whole.astype(np.uint8) * 255)
        pair = np.stack([_padded(seen, size_px, 0), _padded(outline, size_px, 0)])
        share = area / max(float(whole.sum()) * zoom, 1.0)
        enough = area >= MIN_VISIBLE_PX and share >= MIN_VISIBLE_SHARE
        (kept if enough else hidden).append(pair)
    nothing = np.zeros((0, 2, size_px, size_px), np.uint8)
    return np.stack(kept) if kept else nothing, np.stack(hidden) if hidden else nothing


def _mask_boxes(masks: npt.NDArray[np.uint8]) -> F32:
    return np.array([tight_box(m[0]) for m in masks], np.float32).reshape(-1, 4)


def _cut_boxes(boxes: F32, side: int, least: float = MIN_BOX_SHARE) -> tuple[F32, F32]:
    """Boxes (N, 4) cut at the crop's border: those mostly inside, and the rest that shows."""
    inside = np.clip(boxes, 0, side)
    area = np.prod(inside[:, 2:] - inside[:, :2], axis=1)
    before = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1).clip(1e-6)
    enough = (area >= MIN_VISIBLE_PX) & (area >= least * before)
    return inside[enough], inside[~enough & (area > 0)]
