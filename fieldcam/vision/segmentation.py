"""Instance masks from the Mask R-CNN graph (paper section III-D).

The graph gives each instance's mask as logits on a small grid of cells spread
evenly over `mask_box`. Nothing is pasted into full-size images: logits are
resampled onto the pixels of the mask's own window only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import FloatMap, ImageU8, Instance, Mask, Region
from fieldcam.vision.onnx_session import Network, OnnxModel, Signature, network_image

SIGNATURE = Signature(
    frozenset({"image"}), frozenset({"boxes", "scores", "mask_boxes", "mask_logits"})
)
SCORE_THRESHOLD = 0.4
"""The authors' score threshold at inference."""
FAINT_FROM = 0.2
"""From this score on something may be a fruitlet, though it is not called one."""
MIN_AREA_PX = 30
"""Smaller visible masks are specks, about 1.4 mm across at working distance."""
MAX_COVERED = 0.6
"""An instance that a better one covers by more than this share is its double."""


@dataclass(frozen=True, slots=True, eq=False)
class Segmented:
    """What was found in an image, in image pixels."""

    instances: tuple[Instance, ...]
    """Fruitlets; best score first."""
    faint_px: tuple[tuple[float, float], ...]
    """Middles (x, y) of what looks like one, but not enough to be called one."""


class Segmentation(Protocol):
    """What finds fruitlets in an image."""

    def segment(self, image: ImageU8, region: Region | None = None) -> Segmented:
        """Fruitlets of an image (H, W, 3) or (H, W), or of a region of it."""
        ...


class Segmenter:
    """The Mask R-CNN graph; `scale` resizes images before they enter it."""

    def __init__(
        self,
        path: Path,
        score_threshold: float = SCORE_THRESHOLD,
        scale: float = 1.0,
        model: Network | None = None,
    ) -> None:
        self.score_threshold = score_threshold
        self._model = model or OnnxModel(path, SIGNATURE)
        self._scale = scale

    def warm_up(self) -> None:
        self._model.warm_up()

    def segment(self, image: ImageU8, region: Region | None = None) -> Segmented:
        """Fruitlets of an image (H, W, 3) or (H, W), or of a region of it."""
        height, width = image.shape[:2]
        region = region or Region.whole(width, height)
        crop = image[region.slices]
        if self._scale != 1.0:
            size = (round(region.width * self._scale), round(region.height * self._scale))
            crop = np.asarray(cv2.resize(crop, size, interpolation=cv2.INTER_AREA), np.uint8)
        output = self._model.run({"image": network_image(crop)})
        grow = np.array([region.width / crop.shape[1], region.height / crop.shape[0]] * 2)
        shift = np.array([region.x0, region.y0] * 2)
        raw = RawInstances(
            boxes_px=output["boxes"] * grow + shift,
            scores=output["scores"],
            mask_boxes_px=output["mask_boxes"] * grow + shift,
            mask_logits=output["mask_logits"],
            seen_fractions=output.get("visible_fractions"),
            width_sds=output.get("width_sds"),
        )
        found = instances(raw, region, self.score_threshold)
        return Segmented(found, faint(raw, found, self.score_threshold))


@dataclass(frozen=True, slots=True, eq=False)
class RawInstances:
    """The graph's outputs, boxes in image pixels."""

    boxes_px: npt.NDArray[np.floating]
    """(N, 4) x0, y0, x1, y1 of the visible parts; edges, so pixel i spans i to i + 1."""
    scores: npt.NDArray[np.floating]
    """(N,)."""
    mask_boxes_px: npt.NDArray[np.floating]
    """(N, 4): what the mask cells cover; edges as above."""
    mask_logits: npt.NDArray[np.floating]
    """(N, C, M, M); channel 0 visible, channel 1, where there is one, whole."""
    seen_fractions: npt.NDArray[np.floating] | None = None
    """(N,) share of each fruitlet that shows; None from a network that does not say."""
    width_sds: npt.NDArray[np.floating] | None = None
    """(N,) relative standard deviation of the whole mask's width; None likewise."""


def instances(raw: RawInstances, region: Region, score_threshold: float) -> tuple[Instance, ...]:
    """Turn the graph's outputs into instances with disjoint visible masks."""
    keep = np.flatnonzero(raw.scores >= score_threshold)
    order = keep[np.argsort(-raw.scores[keep], kind="stable")]
    found = [_instance(raw, int(i), region) for i in order]
    single = _without_doubles([f for f in found if f is not None])
    return tuple(f for f in disjoint(single) if f.visible.area_px >= MIN_AREA_PX)


def faint(
    raw: RawInstances, found: Sequence[Instance], score_threshold: float
) -> tuple[tuple[float, float], ...]:
    """Middles of the boxes that score too low, but for those in the middle of a fruitlet."""
    low = (raw.scores >= FAINT_FROM) & (raw.scores < score_threshold)
    middles = (raw.boxes_px[low, :2] + raw.boxes_px[low, 2:]) / 2
    return tuple((float(x), float(y)) for x, y in middles if not _within(x, y, found))


def _within(x: float, y: float, found: Sequence[Instance]) -> bool:
    boxes = (instance.box_px for instance in found)
    return any(x0 <= x <= x1 and y0 <= y <= y1 for x0, y0, x1, y1 in boxes)


def _instance(raw: RawInstances, index: int, region: Region) -> Instance | None:
    box = tuple(float(v) for v in raw.mask_boxes_px[index])
    (left, top), (right, bottom) = map(math.floor, box[:2]), map(math.ceil, box[2:])
    window = Region(left, top, right, bottom).overlap(region)
    if min(window.width, window.height) < 2:
        return None
    logits = [resample(cells, box, window) for cells in raw.mask_logits[index]]
    x0, y0, x1, y1 = (float(v) for v in raw.boxes_px[index])
    return Instance(
        box_px=(x0, y0, x1, y1),
        score=float(raw.scores[index]),
        visible=Mask(window.x0, window.y0, logits[0] > 0),
        visible_logits=logits[0],
        whole_logits=logits[1] if len(logits) > 1 else None,
        seen_fraction=None if raw.seen_fractions is None else float(raw.seen_fractions[index]),
        width_sd=None if raw.width_sds is None else float(raw.width_sds[index]),
    )


def resample(cells: npt.NDArray[np.floating], box: Sequence[float], window: Region) -> FloatMap:
    """Mask logits at the pixels of a window, bilinear between cell centres.

    `cells` is (M, M); cell k of an axis is centred at x0 + (k + 1/2) / M of the
    box's width, and pixel i at i + 1/2, as in RoIAlign. Beyond the outermost
    cell centres the outermost value holds.
    """
    rows = _weights(cells.shape[0], box[1], box[3], window.y0, window.y1)
    columns = _weights(cells.shape[1], box[0], box[2], window.x0, window.x1)
    return np.asarray(rows @ cells.astype(np.float64) @ columns.T, dtype=np.float32)


def _weights(cells: int, low: float, high: float, first: int, last: int) -> npt.NDArray[np.float64]:
    """Linear interpolation weights (pixels, cells) along one axis."""
    position = (np.arange(first, last) + 0.5 - low) / (high - low) * cells - 0.5
    position = np.clip(position, 0, cells - 1)
    below = np.minimum(position.astype(int), cells - 2)
    weights = np.zeros((len(position), cells))
    pixels = np.arange(len(position))
    weights[pixels, below] = below + 1 - position
    weights[pixels, below + 1] = position - below
    return weights


def disjoint(found: Sequence[Instance]) -> list[Instance]:
    """Give each pixel to the instance with the highest probability there.

    The loser's logit becomes its lead over the winner, so that the edge between
    two fruitlets stays where the two are equal, to a fraction of a pixel. (The
    authors give the pixel to the higher score of the whole detection.)
    """
    lead = [f.visible_logits.copy() for f in found]
    for i, first in enumerate(found):
        for j in range(i):
            second = found[j]
            shared = first.visible.region.overlap(second.visible.region)
            at_first = shared.slices_in(first.visible.region)
            at_second = shared.slices_in(second.visible.region)
            margin = first.visible_logits[at_first] - second.visible_logits[at_second]
            lead[i][at_first] = np.minimum(lead[i][at_first], margin)
            lead[j][at_second] = np.minimum(lead[j][at_second], -margin)
    return [_with_logits(f, logits) for f, logits in zip(found, lead, strict=True)]


def is_cut(instance: Instance, region: Region) -> bool:
    """Whether the visible mask runs into the border of the region that was searched."""
    seen = instance.visible.tight
    return seen.area_px > 0 and seen.region.overlap(region.grown(-1)) != seen.region


def _without_doubles(found: Sequence[Instance]) -> list[Instance]:
    kept: list[Instance] = []
    for candidate in found:
        area = max(candidate.visible.area_px, 1)
        covered = (candidate.visible.shared_px(other.visible) for other in kept)
        if all(shared_px <= MAX_COVERED * area for shared_px in covered):
            kept.append(candidate)
    return kept


def _with_logits(instance: Instance, logits: FloatMap) -> Instance:
    mask = instance.visible
    return replace(instance, visible=Mask(mask.x0, mask.y0, logits > 0), visible_logits=logits)
