"""Training batches of stereo pairs, from rendered windows and from drawn layers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.utils.data import Dataset

from export.stereo_augment import disturb
from export.stereo_sample import StereoSample, mirrored_swap, shrink
from export.stereo_scenes import LayeredScenes

SEARCH_PX = 32.0
"""Residuals that the network must find, in px of its input, either way."""

SHRINK = 2.0
"""Pixels of a rendered window in one pixel of the network's input."""

JITTER_PX = 48
"""Largest change of a window's offset, in px of the window."""

SHAPES = ((4, 192), (6, 160))
"""Pairs in a batch and the side of their crops, taken in turn."""

RELIST_EVERY = 25
"""Batches after which the folder is looked at again: it may still be filling."""

REDRAW_EVERY = 150
"""Batches after which drawn scenes get new textures, which cost more than a batch."""


@dataclass(frozen=True, slots=True, eq=False)
class StereoBatch:
    """Pairs and truth; (B, 3, h, w) and (B, 1, h, w), disparities in input px."""

    left: Tensor
    right: Tensor
    disparity: Tensor
    """0 where `known` is false."""
    known: Tensor
    """Where the true disparity is known and within SEARCH_PX."""
    matched: Tensor
    """1.0 where the pixel is visible in both eyes and inside the searched window."""
    decided: Tensor
    """Where `matched` is known."""
    fruit: Tensor
    """Where a fruitlet is seen."""


def list_shards(folder: Path) -> list[Path]:
    """The rendered windows that are there now."""
    return sorted(folder.glob("*.npz"))


def read_shard(path: Path) -> StereoSample:
    """One rendered window at full resolution, its disparity less its offset."""
    with np.load(path) as arrays:
        disparity = arrays["disparity"] - np.float32(arrays["offset_px"])
        known = np.isfinite(disparity)
        return StereoSample(
            left=arrays["left"],
            right=arrays["right"],
            disparity=disparity,
            seen=arrays["noc"] & known,
            decided=np.ones(disparity.shape, bool),
            fruit=arrays["labels"] > 0,
        )


def cut(window: StereoSample, top: int, start: int, side: int, later: int) -> StereoSample:
    """A square of the window, its right eye cut `later` px further right.

    Residuals grow by `later`. Where the right eye's cut leaves the window it
    repeats the window's edge, and what would be seen there counts as unseen.
    """
    width = window.disparity.shape[1]
    rows, columns = np.arange(top, top + side), np.arange(start, start + side)
    block = np.ix_(rows, columns)
    disparity = window.disparity[block]
    column = np.nan_to_num(columns - disparity, nan=-1.0)
    kept = (column >= 0) & (column <= width - 1)
    from_right = np.clip(columns + later, 0, width - 1)
    return StereoSample(
        left=window.left[block],
        right=window.right[np.ix_(rows, from_right)],
        disparity=disparity + np.float32(later),
        seen=window.seen[block] & kept,
        decided=window.decided[block],
        fruit=window.fruit[block],
    )


def random_crop(window: StereoSample, rng: np.random.Generator, side: int) -> StereoSample:
    """A crop of `side` px at about half the window's resolution, somewhere in it."""
    height = window.disparity.shape[0]
    smallest = max(0.6, SHRINK * side / height)
    scale = float(np.exp(rng.uniform(np.log(smallest), np.log(1.5))))
    if rng.random() < 0.3:
        scale = max(1.0, smallest)
    source = min(height, round(SHRINK * side / scale))
    top, start = (int(n) for n in rng.integers(0, height - source + 1, 2))
    later = int(rng.integers(-JITTER_PX, JITTER_PX + 1)) if rng.random() < 0.7 else 0
    crop = cut(window, top, start, source, later)
    if rng.random() < 0.5:
        crop = mirrored_swap(crop)
    return _maybe_upside_down(shrink(crop, side, side), rng)


def _maybe_upside_down(sample: StereoSample, rng: np.random.Generator) -> StereoSample:
    if rng.random() > 0.3:
        return sample
    return StereoSample(
        sample.left[::-1],
        sample.right[::-1],
        sample.disparity[::-1],
        sample.seen[::-1],
        sample.decided[::-1],
        sample.fruit[::-1],
    )


def to_batch(samples: list[StereoSample]) -> StereoBatch:
    """Samples of one size, stacked, with what the losses need."""
    width = samples[0].disparity.shape[1]
    disparity = np.stack([sample.disparity for sample in samples])
    known = np.isfinite(disparity) & (np.abs(np.nan_to_num(disparity)) <= SEARCH_PX)
    disparity = np.where(known, disparity, 0)
    column = np.arange(width) - disparity
    inside = (column >= 0) & (column <= width - 1)
    matched = np.stack([sample.seen for sample in samples]) & known & inside
    decided = np.stack([sample.decided for sample in samples])
    return StereoBatch(
        left=_images([sample.left for sample in samples]),
        right=_images([sample.right for sample in samples]),
        disparity=torch.from_numpy(disparity.astype(np.float32))[:, None],
        known=torch.from_numpy(known)[:, None],
        matched=torch.from_numpy(matched.astype(np.float32))[:, None],
        decided=torch.from_numpy(decided)[:, None],
        fruit=torch.from_numpy(np.stack([sample.fruit for sample in samples]))[:, None],
    )


def _images(images: list[np.ndarray[tuple[int, ...], np.dtype[np.uint8]]]) -> Tensor:
    stacked = np.ascontiguousarray(np.stack(images).transpose(0, 3, 1, 2))
    return torch.from_numpy(stacked)


class StereoBatches(Dataset[StereoBatch]):
    """Batch number n of a training run, always the same for a seed and a folder's content."""

    def __init__(
        self, folder: Path, seed: int, drawn_share: float, photographs: Path | None = None
    ) -> None:
        self._folder = folder
        self._photographs = sorted(photographs.glob("*/images/*.jpg")) if photographs else []
        self._seed = seed
        self._drawn_share = drawn_share
        self._shards: list[Path] = []
        self._listed = -1
        self._drawn = -1
        self._scenes = LayeredScenes(seed, textures=0)

    def __len__(self) -> int:
        return 10**9

    def __getitem__(self, number: int) -> StereoBatch:
        cv2.setNumThreads(1)
        rng = np.random.default_rng((self._seed, number))
        if number // RELIST_EVERY != self._listed:
            self._listed = number // RELIST_EVERY
            self._shards = list_shards(self._folder)
        if number // REDRAW_EVERY != self._drawn:
            self._drawn = number // REDRAW_EVERY
            seed = self._seed + self._drawn
            self._scenes = LayeredScenes(seed, photographs=self._photographs)
        pairs, side = SHAPES[number % len(SHAPES)]
        return to_batch([self._sample(rng, side) for _ in range(pairs)])

    def _sample(self, rng: np.random.Generator, side: int) -> StereoSample:
        if self._shards and rng.random() > self._drawn_share:
            path = self._shards[int(rng.integers(len(self._shards)))]
            return disturb(random_crop(read_shard(path), rng, side), rng)
        return disturb(self._scenes.draw(rng, side, SEARCH_PX), rng)


def validation_batches(folder: Path, limit: int, side: int = 224) -> Iterator[StereoBatch]:
    """The middle of each window at half resolution, undisturbed; drawn pairs where none are."""
    shards = list_shards(folder)[:limit]
    for path in shards:
        window = read_shard(path)
        source = round(SHRINK * side)
        corner = (window.disparity.shape[0] - source) // 2
        yield to_batch([shrink(cut(window, corner, corner, source, 0), side, side)])
    if not shards:
        yield from drawn_batches(limit, side)


def drawn_batches(count: int, side: int = 224) -> Iterator[StereoBatch]:
    """Layered pairs that training never sees, with a little noise."""
    scenes = LayeredScenes(seed=2**31 - 1)
    rng = np.random.default_rng(2**31 - 1)
    for _ in range(count):
        sample = scenes.draw(rng, side, SEARCH_PX)
        noise = [rng.normal(0, 2, eye.shape) for eye in (sample.left, sample.right)]
        left, right = (
            np.clip(eye + grain, 0, 255).astype(np.uint8)
            for eye, grain in zip((sample.left, sample.right), noise, strict=True)
        )
        yield to_batch([replace(sample, left=left, right=right)])
