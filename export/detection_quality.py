"""How well a network finds fruit that is known by boxes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt
import torch
from torchvision.ops import box_iou

from export.mask_rcnn import FruitletMaskRCNN
from export.roi_ignore import on_ignored
from export.segmentation_quality import uncut
from export.segmentation_window import Window

MATCH_IOU = 0.5
SCORES = (0.5, 0.8)


@dataclass(frozen=True, slots=True)
class Found:
    """One detection: its score, and whether it is a fruit not found before."""

    score: float
    right: bool


@dataclass(frozen=True, slots=True)
class BoxQuality:
    """Figures at IoU 0.5 over a set of pictures."""

    average_precision: float
    precision_50: float
    recall_50: float
    precision_80: float
    recall_80: float
    fruit: int

    def to_dict(self) -> dict[str, float]:
        """Rounded, for a log line."""
        return {name: round(float(value), 4) for name, value in asdict(self).items()}


def match(boxes: torch.Tensor, scores: torch.Tensor, truth: torch.Tensor) -> list[Found]:
    """Detections (N, 4), best first, matched greedily to true boxes (K, 4)."""
    free = torch.ones(len(truth), dtype=torch.bool)
    overlaps = box_iou(boxes, truth)
    found = []
    for overlap, score in zip(overlaps, scores.tolist(), strict=True):
        open_overlap = overlap * free
        right = bool(len(truth)) and float(open_overlap.max()) >= MATCH_IOU
        if right:
            free[int(open_overlap.argmax())] = False
        found.append(Found(score, right))
    return found


def average_precision(found: list[Found], total: int) -> float:
    """Area under precision over recall, precision made to fall with recall (VOC 2010)."""
    if not total or not found:
        return 0.0
    ordered = sorted(found, key=lambda f: -f.score)
    hits = np.cumsum([f.right for f in ordered])
    precision = hits / np.arange(1, len(ordered) + 1)
    envelope: npt.NDArray[np.float64] = np.maximum.accumulate(precision[::-1])[::-1]
    return float(envelope[[f.right for f in ordered]].sum() / total)


def _at(found: list[Found], total: int, score: float) -> tuple[float, float]:
    kept = [f for f in found if f.score >= score]
    right = sum(f.right for f in kept)
    return right / max(len(kept), 1), right / max(total, 1)


@torch.no_grad()
def measure_boxes(model: FruitletMaskRCNN, windows: Iterable[Window]) -> BoxQuality:
    """Figures of a network in inference mode; what lies on an unknown place counts neither way."""
    found: list[Found] = []
    total = 0
    for window in windows:
        sample = uncut(window)
        pixels = torch.from_numpy(sample.image.transpose(2, 0, 1).astype(np.float32))
        seen = model.detect(pixels)
        truth = torch.from_numpy(sample.boxes[: sample.certain])
        unknown = torch.from_numpy(sample.boxes[sample.certain :])
        counted = ~on_ignored(seen.boxes, unknown)
        found += match(seen.boxes[counted], seen.scores[counted], truth)
        total += len(truth)
    half, strict = (_at(found, total, score) for score in SCORES)
    return BoxQuality(average_precision(found, total), *half, *strict, total)
