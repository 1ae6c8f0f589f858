"""Training crops for Mask R-CNN from shard files: reading, cutting, targets.

A shard is one `.npz` window. Rendered ones hold `left`, `labels`, `whole` and
more; drawn ones (`export.drawn_crops`) hold `image`, `labels`, `whole`.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset

from export.photometric import jitter
from export.roi_ignore import IGNORED

ImageU8 = npt.NDArray[np.uint8]

MIN_VISIBLE_PX = 25.0
MIN_VISIBLE_SHARE = 0.15
FRUIT_SHARE = 0.85
"""Share of crops that are placed on a fruitlet's pixel."""
RELIST_EVERY = 64
"""Samples after which the folders are listed again: they may still be filling."""


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """One picture with its fruitlets."""

    image: ImageU8
    """(H, W, 3) RGB."""
    labels: npt.NDArray[np.uint8]
    """(H, W) 0 none, k the visible pixels of fruitlet k."""
    whole: npt.NDArray[np.bool_]
    """(K, H, W) silhouettes, hidden part included."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One training crop, before it becomes tensors."""

    image: ImageU8
    masks: npt.NDArray[np.uint8]
    """(K, 2, H, W) 0 to 255: visible part, whole fruitlet."""
    boxes: npt.NDArray[np.float32]
    """(K, 4) of the visible part, pixel-edge coordinates."""
    ignored: npt.NDArray[np.bool_]
    """(K,) too little to be seen; these come last."""


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


def list_shards(folder: Path) -> list[Path]:
    """Finished shards of a folder, by name."""
    return sorted(folder.glob("*.npz")) if folder.is_dir() else []


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


def _corner(focus: float, side: int, room: int, rng: np.random.Generator) -> int:
    """Start of a random span of `side` pixels out of `room` that holds `focus`."""
    low = max(0, int(focus) - side + 1)
    high = min(room - side, int(focus))
    return int(rng.integers(low, high + 1))


def place(
    labels: npt.NDArray[np.uint8], settings: CropSettings, rng: np.random.Generator
) -> Placement:
    """A random square of a window at a random scale, mostly one with fruit in it."""
    height, width = labels.shape
    low, high = np.log(settings.min_scale), np.log(settings.max_scale)
    scale = float(np.exp(rng.uniform(low, high)))
    side = min(round(settings.size_px / scale), height, width)
    fruit = np.flatnonzero(labels)
    anywhere = not len(fruit) or rng.random() > FRUIT_SHARE
    spot = int(rng.integers(0, labels.size)) if anywhere else int(rng.choice(fruit))
    return Placement(
        x=_corner(spot % width, side, width, rng),
        y=_corner(spot // width, side, height, rng),
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
    kept: list[npt.NDArray[np.uint8]] = []
    ignored: list[npt.NDArray[np.uint8]] = []
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
        (kept if enough else ignored).append(pair)
    return _sample(image, kept, ignored, size_px)


def _sample(
    image: ImageU8,
    kept: list[npt.NDArray[np.uint8]],
    ignored: list[npt.NDArray[np.uint8]],
    size_px: int,
) -> Sample:
    both = kept + ignored
    masks = np.stack(both) if both else np.zeros((0, 2, size_px, size_px), np.uint8)
    boxes = np.array([tight_box(m[0]) for m in both], np.float32).reshape(-1, 4)
    flags = np.arange(len(both)) >= len(kept)
    return Sample(image, masks, boxes, flags)


def augment(window: Window, settings: CropSettings, rng: np.random.Generator) -> Sample:
    """A random crop under random light."""
    placement = place(window.labels, settings, rng)
    sample = cut(window, placement, settings.size_px, int(rng.integers(0, 200)))
    fruit = np.zeros(sample.image.shape[:2], np.float32)
    if len(sample.masks):
        fruit = sample.masks[:, 0].max(axis=0).astype(np.float32) / 255.0
    return Sample(jitter(sample.image, fruit, rng), sample.masks, sample.boxes, sample.ignored)


def as_tensors(sample: Sample) -> tuple[Tensor, dict[str, Tensor]]:
    """Image (3, H, W) uint8 and the target; masks stay uint8 to travel cheaply."""
    labels = np.where(sample.ignored, IGNORED, 1).astype(np.int64)
    target = {
        "boxes": torch.from_numpy(sample.boxes),
        "labels": torch.from_numpy(labels),
        "masks": torch.from_numpy(sample.masks[~sample.ignored]),
    }
    return torch.from_numpy(np.ascontiguousarray(sample.image.transpose(2, 0, 1))), target


@dataclass(frozen=True, slots=True)
class Sources:
    """Where windows come from."""

    rendered: Path | None
    drawn: Path | None
    drawn_share: float = 0.35
    """Share of drawn crops while there are rendered ones too."""


class CropStream(IterableDataset[tuple[Tensor, dict[str, Tensor]]]):
    """Endless crops; the n-th one depends on the seed, n and the files present."""

    def __init__(self, sources: Sources, settings: CropSettings, seed: int, start: int) -> None:
        super().__init__()
        self.sources = sources
        self.settings = settings
        self.seed = seed
        self.start = start

    def _pick(self, rendered: list[Path], drawn: list[Path], rng: np.random.Generator) -> Path:
        use_drawn = not rendered or (bool(drawn) and rng.random() < self.sources.drawn_share)
        files = drawn if use_drawn else rendered
        if not files:
            raise FileNotFoundError("no shard files to train on; run export.drawn_crops first")
        return files[int(rng.integers(0, len(files)))]

    def __iter__(self) -> Iterator[tuple[Tensor, dict[str, Tensor]]]:
        cv2.setNumThreads(1)
        torch.set_num_threads(1)
        rendered: list[Path] = []
        drawn: list[Path] = []
        number = self.start
        while True:
            if (number - self.start) % RELIST_EVERY == 0:
                rendered = list_shards(self.sources.rendered) if self.sources.rendered else []
                drawn = list_shards(self.sources.drawn) if self.sources.drawn else []
            rng = np.random.default_rng((self.seed, number))
            number += 1
            try:
                window = read_window(self._pick(rendered, drawn, rng))
            except (zipfile.BadZipFile, EOFError):
                # A shard that is still being written; the next number takes another.
                continue
            yield as_tensors(augment(window, self.settings, rng))


Batch = tuple[Tensor, list[dict[str, Tensor]]]


def collate(samples: list[tuple[Tensor, dict[str, Tensor]]]) -> Batch:
    """Images (B, 3, H, W) uint8 and the list of targets."""
    return torch.stack([image for image, _ in samples]), [target for _, target in samples]


def batches(stream: CropStream, batch_size: int) -> Iterator[Batch]:
    """Batches made by one background process."""
    loader = DataLoader(stream, batch_size, num_workers=1, prefetch_factor=3, collate_fn=collate)
    return iter(loader)
