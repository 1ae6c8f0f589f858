"""Found boxes beside true ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

Box = tuple[float, float, float, float]
"""x0, y0, x1, y1: edges, so pixel i spans i to i + 1."""


@dataclass(frozen=True, slots=True)
class BoxScore:
    """How many boxes were found, were there, and are both."""

    found: int
    true: int
    matched: int

    @property
    def precision(self) -> float:
        return self.matched / self.found if self.found else 1.0

    @property
    def recall(self) -> float:
        return self.matched / self.true if self.true else 1.0


def score_boxes(found: Sequence[Box], true: Sequence[Box], least_iou: float = 0.5) -> BoxScore:
    """Best found box first, each takes the free true box that it overlaps most."""
    free = list(true)
    matched = 0
    for box in found:
        best = max(free, key=lambda other: box_iou(box, other), default=None)
        if best is not None and box_iou(box, best) >= least_iou:
            free.remove(best)
            matched += 1
    return BoxScore(len(found), len(true), matched)


def total(scores: Iterable[BoxScore]) -> BoxScore:
    """Of several pictures, each box counted once."""
    each = list(scores)
    return BoxScore(
        sum(s.found for s in each), sum(s.true for s in each), sum(s.matched for s in each)
    )


def box_iou(a: Box, b: Box) -> float:
    """Shared area over the area of both together."""
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    areas = [(box[2] - box[0]) * (box[3] - box[1]) for box in (a, b)]
    return width * height / (sum(areas) - width * height)


def yolo_boxes(text: str, size_px: tuple[int, int]) -> list[Box]:
    """Boxes in px from lines of class, centre x, centre y, width, height over the image's."""
    width, height = size_px
    boxes = []
    for line in text.splitlines():
        x, y, w, h = (float(word) for word in line.split()[1:5])
        boxes.append(
            ((x - w / 2) * width, (y - h / 2) * height, (x + w / 2) * width, (y + h / 2) * height)
        )
    return boxes
