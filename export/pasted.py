"""Rendered and drawn fruit laid on photographs of real leaves.

The front of a window is what stands no farther away than its fruit: fruit,
stems, leaves, tag. It covers the photograph; boxes of the photograph that it
covers in part are no longer known.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from export.segmentation_window import F32, ImageU8, Placement, Window

Bool = npt.NDArray[np.bool_]

BEHIND_PX = (1.0, 25.0)
"""How much less disparity than the farthest fruit the front still has: 2 to 50 mm."""
EDGE_SIGMA_PX = 0.7
GAINS = (0.15, 2.0)
COVERED = 0.2
"""Share of a box of the photograph beyond which it is no longer known."""


def read_front(path: Path, rng: np.random.Generator) -> tuple[Window, Bool]:
    """A rendered or drawn shard with the mask (H, W) of its front.

    Of a rendered one, some of the fruit is the farthest that belongs to the front.
    """
    with np.load(path) as shard:
        labels = shard["labels"]
        whole = np.unpackbits(shard["whole"], axis=-1, count=labels.shape[1]).astype(bool)
        if "front" in shard.files:
            front = np.unpackbits(shard["front"], axis=-1, count=labels.shape[1]).astype(bool)
            return Window(shard["image"], labels, whole), front
        image, disparity = shard["left"], shard["disparity"]
    ranges = [
        float(np.nanmedian(disparity[labels == k])) if (labels == k).any() else -np.inf
        for k in range(1, len(whole) + 1)
    ]
    window = Window(image, labels, whole)
    if not any(np.isfinite(ranges)):
        return window, np.zeros(labels.shape, bool)
    farthest = float(rng.choice([r for r in ranges if np.isfinite(r)]))
    front = np.nan_to_num(disparity, nan=-np.inf) > farthest - rng.uniform(*BEHIND_PX)
    for k, fruit_px in enumerate(ranges, start=1):
        front[labels == k] = fruit_px >= farthest
    return window, front


def paste(window: Window, front: Bool, back: Window, rng: np.random.Generator) -> Window:
    """The front of a window before a photograph of the same size."""
    share = cv2.GaussianBlur(front.astype(np.float32), (0, 0), EDGE_SIGMA_PX)[..., None]
    behind = _as_bright(back.image, window.image[front], rng)
    image = window.image * share + behind * (1 - share)
    labels = np.where(front, window.labels, 0).astype(np.uint8)
    boxes, partly = _uncovered(back.boxes, front)
    unknown = np.concatenate([partly, *_uncovered(back.unknown, front)])
    return Window(
        np.clip(image, 0, 255).astype(np.uint8),
        labels,
        window.whole,
        boxes,
        unknown,
    )


def _as_bright(image: ImageU8, front: ImageU8, rng: np.random.Generator) -> F32:
    """The photograph in light that fits what stands before it, more or less."""
    gain = 1.0
    if len(front):
        wanted = float(front.mean()) * np.exp(rng.normal(-0.2, 0.5))
        gain = float(np.clip(wanted / max(float(image.mean()), 1.0), *GAINS))
    return np.asarray(np.clip(image * np.float32(gain), 0, 255), np.float32)


def _uncovered(boxes: F32, front: Bool) -> tuple[F32, F32]:
    """Boxes (N, 4) that are free, and those that are covered in part; the rest are gone."""
    shares = np.array(
        [
            front[int(y0) : max(int(np.ceil(y1)), int(y0) + 1),
                  int(x0) : max(int(np.ceil(x1)), int(x0) + 1)].mean()
            for x0, y0, x1, y1 in boxes
        ]
    ).reshape(-1)  # fmt: skip
    return boxes[shares <= COVERED], boxes[(shares > COVERED) & (shares < 0.97)]


def square_of(window: Window, side: int, rng: np.random.Generator) -> Window:
    """A random square of a photograph without masks, zoomed to `side`."""
    height, width = window.labels.shape
    source = int(rng.integers(min(side, height, width) * 3 // 4, min(height, width) + 1))
    x, y = int(rng.integers(0, width - source + 1)), int(rng.integers(0, height - source + 1))
    square = Placement(x, y, source, side, 0, False)
    return Window(
        square.image(window.image),
        np.zeros((side, side), np.uint8),
        np.zeros((0, side, side), bool),
        *_inside(square.boxes(window.boxes), square.boxes(window.unknown), side),
    )


def _inside(boxes: F32, unknown: F32, side: int) -> tuple[F32, F32]:
    """Boxes cut at a square's border; those that lose more than a little are unknown."""
    both = np.concatenate([boxes, unknown])
    cut = np.clip(both, 0, side)
    area = np.prod(cut[:, 2:] - cut[:, :2], axis=1)
    kept = area / np.prod(both[:, 2:] - both[:, :2], axis=1).clip(1e-6)
    known = np.arange(len(both)) < len(boxes)
    return cut[known & (kept > 0.6)], cut[(area > 0) & ~(known & (kept > 0.6))]
