"""How well a network finds fruitlets and how true the widths of its masks are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field

import cv2
import numpy as np
import numpy.typing as npt
import torch

from export.mask_rcnn import Detections, FruitletMaskRCNN
from export.segmentation_window import Placement, Sample, Window, cut

Bool = npt.NDArray[np.bool_]
F32 = npt.NDArray[np.float32]

SCORE = 0.5
MATCH_IOU = 0.5
OVERSAMPLING = 4
NEARLY_WHOLE = 0.9


@dataclass(frozen=True, slots=True)
class Quality:
    """Figures over a set of windows; pixels are those of the window."""

    precision: float
    recall: float
    median_iou: float
    width_mae_px: float
    """Fruitlets more than 90 % visible; visible mask against the true visible mask."""
    width_bias_px: float
    whole_width_mae_px: float
    """Every matched fruitlet clear of the border; whole mask against the true outline."""
    widths: int
    fruitlets: int

    def to_dict(self) -> dict[str, float]:
        """Rounded, for a log line."""
        return {name: round(float(value), 4) for name, value in asdict(self).items()}


def sample_logits(logits: F32, box: F32, x: F32, y: F32) -> F32:
    """Logits (M, M) of a window at points in pixel-edge coordinates, bilinear."""
    cells = logits.shape[0]
    u = ((x - box[0]) / (box[2] - box[0]) * cells - 0.5).astype(np.float32)
    v = ((y - box[1]) / (box[3] - box[1]) * cells - 0.5).astype(np.float32)
    values = cv2.remap(
        logits, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=-9.0
    )
    return np.asarray(values, dtype=np.float32)


def _points(box: F32, zoom: int) -> tuple[F32, F32]:
    x = np.arange(int(np.floor(box[0])) * zoom, int(np.ceil(box[2])) * zoom) + 0.5
    y = np.arange(int(np.floor(box[1])) * zoom, int(np.ceil(box[3])) * zoom) + 0.5
    columns, rows = np.meshgrid(x / zoom, y / zoom)
    return columns.astype(np.float32), rows.astype(np.float32)


def paste(logits: F32, box: F32, shape: tuple[int, int]) -> Bool:
    """(H, W) pixels whose centres lie inside the outline."""
    x, y = _points(box, 1)
    inside = sample_logits(logits, box, x, y) > 0
    mask = np.zeros(shape, bool)
    columns, rows = np.floor(x[inside]).astype(int), np.floor(y[inside]).astype(int)
    valid = (columns >= 0) & (columns < shape[1]) & (rows >= 0) & (rows < shape[0])
    mask[rows[valid], columns[valid]] = True
    return mask


def short_axis(mask: Bool, zoom: int = 1) -> float:
    """Short axis, in pixels, of the ellipse with the mask's second moments."""
    rows, columns = np.nonzero(mask)
    if len(rows) < 8:
        return 0.0
    spread = np.cov(np.stack([columns, rows]).astype(np.float64))
    return 4.0 * float(np.sqrt(np.linalg.eigvalsh(spread)[0])) / zoom


def width_of_logits(logits: F32, box: F32) -> float:
    """Short axis of the outline where interpolated logits are 0."""
    x, y = _points(box, OVERSAMPLING)
    return short_axis(sample_logits(logits, box, x, y) > 0, OVERSAMPLING)


def _iou(one: Bool, other: Bool) -> float:
    union = np.count_nonzero(one | other)
    return np.count_nonzero(one & other) / union if union else 0.0


@dataclass(slots=True, eq=False)
class Tally:
    """Counts gathered window by window."""

    found: int = 0
    false: int = 0
    fruitlets: int = 0
    ious: list[float] = field(default_factory=list)
    visible_errors: list[float] = field(default_factory=list)
    whole_errors: list[float] = field(default_factory=list)

    def add(self, truth: Sample, seen: Detections) -> None:
        """Matches one window's detections, best first, to its fruitlets."""
        masks = np.concatenate([truth.masks, truth.hidden]) > 127
        kept = len(truth.masks)
        self.fruitlets += kept
        free = set(range(kept))
        logits, boxes = seen.mask_logits.numpy(), seen.mask_boxes.numpy()
        for index in np.flatnonzero(seen.scores.numpy() >= SCORE):
            mask = paste(logits[index, 0], boxes[index], masks.shape[2:])
            overlap = [_iou(mask, m[0]) for m in masks]
            best = int(np.argmax(overlap)) if overlap else -1
            if best in free and overlap[best] >= MATCH_IOU:
                free.remove(best)
                self.found += 1
                self.ious.append(overlap[best])
                self._widths(masks[best], logits[index], boxes[index])
            elif best < kept or overlap[best] < 0.2:
                self.false += 1

    def _widths(self, truth: Bool, logits: F32, box: F32) -> None:
        visible, whole = truth
        edge = np.concatenate([whole[0], whole[-1], whole[:, 0], whole[:, -1]])
        if edge.any():
            return
        if visible.sum() > NEARLY_WHOLE * whole.sum():
            self.visible_errors.append(width_of_logits(logits[0], box) - short_axis(visible))
        if logits.shape[0] > 1:
            self.whole_errors.append(width_of_logits(logits[1], box) - short_axis(whole))

    def quality(self) -> Quality:
        """The figures; NaN where nothing was measured."""
        visible, whole = np.array(self.visible_errors), np.array(self.whole_errors)
        return Quality(
            precision=self.found / max(self.found + self.false, 1),
            recall=self.found / max(self.fruitlets, 1),
            median_iou=float(np.median(self.ious)) if self.ious else float("nan"),
            width_mae_px=float(np.abs(visible).mean()) if len(visible) else float("nan"),
            width_bias_px=float(visible.mean()) if len(visible) else float("nan"),
            whole_width_mae_px=float(np.abs(whole).mean()) if len(whole) else float("nan"),
            widths=len(visible),
            fruitlets=self.fruitlets,
        )


def uncut(window: Window) -> Sample:
    """A whole window as a sample; of one that is not square, the square at its corner."""
    side = min(window.labels.shape)
    return cut(window, Placement(0, 0, side, side, 0, False), side)


@torch.no_grad()
def measure(model: FruitletMaskRCNN, windows: Iterable[Window]) -> Quality:
    """Figures of a network in inference mode over whole windows."""
    tally = Tally()
    for window in windows:
        truth = uncut(window)
        pixels = torch.from_numpy(truth.image.transpose(2, 0, 1).astype(np.float32))
        tally.add(truth, model.detect(pixels))
    return tally.quality()
