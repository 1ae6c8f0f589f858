"""Endless training crops for Mask R-CNN: photographs, rendered, drawn and pasted windows.

A shard is one `.npz` window. Rendered ones (`export.render_windows`) hold
`left`, `labels`, `whole`, `disparity`; drawn ones (`export.drawn_crops`)
`image`, `labels`, `whole`, `front`.
"""

from __future__ import annotations

import signal
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from export.pasted import paste, read_front, square_of
from export.photometric import jitter
from export.real_tiles import RealTiles, list_tiles
from export.roi_ignore import IGNORED
from export.segmentation_window import (
    CropSettings,
    Sample,
    Window,
    cut,
    place,
    read_window,
)

RELIST_EVERY = 64
"""Samples after which the folders are listed again: they may still be filling."""


class Kind(StrEnum):
    """What a crop is cut from."""

    REAL = "real"
    RENDERED = "rendered"
    DRAWN = "drawn"
    PASTED = "pasted"


DEFAULT_SHARES = {Kind.REAL: 0.4, Kind.RENDERED: 0.25, Kind.DRAWN: 0.15, Kind.PASTED: 0.2}


@dataclass(frozen=True, slots=True)
class Sources:
    """Where windows come from; a folder that is not given is not used."""

    rendered: Path | None = None
    drawn: Path | None = None
    real: Path | None = None
    unknown: Path | None = None
    """What `export.find_unknown` wrote of the photographs."""
    shares: dict[Kind, float] = field(default_factory=lambda: dict(DEFAULT_SHARES))


def list_shards(folder: Path | None) -> list[Path]:
    """Finished shards of a folder, by name."""
    return sorted(folder.glob("*.npz")) if folder is not None and folder.is_dir() else []


def augment(window: Window, settings: CropSettings, rng: np.random.Generator) -> Sample:
    """A random crop under random light."""
    placement = place(window, settings, rng)
    sample = cut(window, placement, settings.size_px, int(rng.integers(0, 200)))
    fruit = np.zeros(sample.image.shape[:2], np.float32)
    if len(sample.masks):
        fruit = sample.masks[:, 0].max(axis=0).astype(np.float32) / 255.0
    image = jitter(sample.image, fruit, rng)
    return Sample(image, sample.masks, sample.boxes, sample.certain, sample.hidden)


def as_tensors(sample: Sample) -> tuple[Tensor, dict[str, Tensor]]:
    """Image (3, H, W) uint8 and the target; masks stay uint8 to travel cheaply."""
    labels = np.where(np.arange(len(sample.boxes)) < sample.certain, 1, IGNORED)
    target = {
        "boxes": torch.from_numpy(sample.boxes),
        "labels": torch.from_numpy(labels.astype(np.int64)),
        "masks": torch.from_numpy(sample.masks),
    }
    return torch.from_numpy(np.ascontiguousarray(sample.image.transpose(2, 0, 1))), target


class _Shelf:
    """What the sources hold now."""

    def __init__(self, sources: Sources) -> None:
        self._sources = sources
        self._tiles = RealTiles()
        if sources.real is not None:
            self._tiles = list_tiles(sources.real, held_back=False, noted=sources.unknown)
        self.relist()

    def relist(self) -> None:
        """Looks into the folders of shards again."""
        self._rendered = list_shards(self._sources.rendered)
        self._drawn = list_shards(self._sources.drawn)

    def _kinds(self) -> list[Kind]:
        has = {
            Kind.REAL: bool(self._tiles.folders),
            Kind.RENDERED: bool(self._rendered),
            Kind.DRAWN: bool(self._drawn),
            Kind.PASTED: bool(self._tiles.folders) and bool(self._rendered or self._drawn),
        }
        return [kind for kind in Kind if has[kind] and self._sources.shares.get(kind, 0) > 0]

    def draw(self, rng: np.random.Generator) -> Window | None:
        """A random window; nothing where its file cannot be read now."""
        kinds = self._kinds()
        if not kinds:
            raise FileNotFoundError("no pictures to train on; run export.drawn_crops first")
        shares = np.array([self._sources.shares[kind] for kind in kinds])
        kind = kinds[int(rng.choice(len(kinds), p=shares / shares.sum()))]
        if kind is Kind.REAL:
            return self._tiles.pick(rng).read()
        files = {Kind.RENDERED: self._rendered, Kind.DRAWN: self._drawn}.get(kind)
        if files is None:
            return self._pasted(rng)
        return read_window(files[int(rng.integers(len(files)))])

    def _pasted(self, rng: np.random.Generator) -> Window | None:
        folders = [files for files in (self._rendered, self._drawn) if files]
        files = folders[int(rng.integers(len(folders)))]
        back = self._tiles.pick(rng).read()
        if back is None:
            return None
        window, front = read_front(files[int(rng.integers(len(files)))], rng)
        return paste(window, front, square_of(back, len(front), rng), rng)


class CropStream(IterableDataset[tuple[Tensor, dict[str, Tensor]]]):
    """Endless crops; the n-th one depends on the seed, n and the files present."""

    def __init__(self, sources: Sources, settings: CropSettings, seed: int, start: int) -> None:
        super().__init__()
        self.sources = sources
        self.settings = settings
        self.seed = seed
        self.start = start

    def __iter__(self) -> Iterator[tuple[Tensor, dict[str, Tensor]]]:
        cv2.setNumThreads(1)
        torch.set_num_threads(1)
        if get_worker_info() is not None:
            # Whoever ends the run by a signal to all its processes wants a checkpoint first.
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
        shelf = _Shelf(self.sources)
        number = self.start
        while True:
            if (number - self.start) % RELIST_EVERY == 0:
                shelf.relist()
            rng = np.random.default_rng((self.seed, number))
            number += 1
            try:
                window = shelf.draw(rng)
            except (zipfile.BadZipFile, EOFError):
                # A shard that is still being written; the next number takes another.
                continue
            if window is not None:
                yield as_tensors(augment(window, self.settings, rng))


Batch = tuple[Tensor, list[dict[str, Tensor]]]


def collate(samples: list[tuple[Tensor, dict[str, Tensor]]]) -> Batch:
    """Images (B, 3, H, W) uint8 and the list of targets."""
    return torch.stack([image for image, _ in samples]), [target for _, target in samples]


def batches(stream: CropStream, batch_size: int) -> Iterator[Batch]:
    """Batches made by one background process."""
    loader = DataLoader(stream, batch_size, num_workers=1, prefetch_factor=3, collate_fn=collate)
    return iter(loader)
