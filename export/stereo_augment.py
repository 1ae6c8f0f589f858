"""What two real eyes do differently from two rendered ones."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from export.stereo_sample import Image, StereoSample

MISALIGNED_PX = 0.7
"""Largest vertical error of a worn calibration, in px of the network's input."""


def disturb(sample: StereoSample, rng: np.random.Generator) -> StereoSample:
    """The sample with other light, blur, noise, a vertical shift and patches erased."""
    look = _Look(rng, 1.0)
    left, right = look.apply(sample.left), look.apply(sample.right)
    if rng.random() < 0.7:
        left = _Look(rng, 0.25).apply(left)
    if rng.random() < 0.5:
        right = _shifted_down(right, float(rng.uniform(-MISALIGNED_PX, MISALIGNED_PX)))
    left, right = _soften(left, right, rng)
    left, right = _with_noise(left, right, rng)
    changed = replace(sample, left=left, right=right)
    return _with_patches_erased(changed, rng) if rng.random() < 0.4 else changed


class _Look:
    """A gamma, a gain for each colour, a contrast and an offset, as one table."""

    def __init__(self, rng: np.random.Generator, strength: float) -> None:
        gamma = np.exp(strength * rng.normal(0, 0.2))
        gain = np.exp(strength * (rng.normal(0, 0.25) + rng.normal(0, 0.07, 3)))
        contrast = np.exp(strength * rng.normal(0, 0.15))
        offset = strength * rng.normal(0, 10)
        tone = 255 * (np.arange(256)[:, None] / 255) ** gamma * gain
        table = (tone - 100) * contrast + 100 + offset
        self._table = np.clip(table, 0, 255).astype(np.uint8)[None]

    def apply(self, image: Image) -> Image:
        return cv2.LUT(image, self._table).astype(np.uint8)


def _shifted_down(image: Image, rows: float) -> Image:
    height, width = image.shape[:2]
    move = np.array([[1, 0, 0], [0, 1, rows]], np.float64)
    moved = cv2.warpAffine(
        image, move, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return moved.astype(np.uint8)


def _soften(left: Image, right: Image, rng: np.random.Generator) -> tuple[Image, Image]:
    if rng.random() > 0.4:
        return left, right
    both, extra = rng.uniform(0.1, 1.2), rng.uniform(0, 0.5)
    return _blurred(left, both), _blurred(right, both + extra)


def _blurred(image: Image, sigma: float) -> Image:
    return cv2.GaussianBlur(image, (0, 0), sigma).astype(np.uint8)


def _with_noise(left: Image, right: Image, rng: np.random.Generator) -> tuple[Image, Image]:
    sigma = abs(rng.normal(0, 3.5))
    noisy = [
        np.clip(eye + sigma * rng.standard_normal(eye.shape, np.float32) + 0.5, 0, 255)
        for eye in (left, right)
    ]
    return noisy[0].astype(np.uint8), noisy[1].astype(np.uint8)


def _with_patches_erased(sample: StereoSample, rng: np.random.Generator) -> StereoSample:
    """Patches of the right eye in one colour; what they hide is no longer seen."""
    height, width = sample.disparity.shape
    right, erased = sample.right.copy(), np.zeros((height, width), bool)
    for _ in range(int(rng.integers(1, 3))):
        tall, wide = (int(n) for n in rng.integers(10, max(11, width // 4), 2))
        y, x = int(rng.integers(0, height - tall)), int(rng.integers(0, width - wide))
        right[y : y + tall, x : x + wide] = right.mean(axis=(0, 1))
        erased[y : y + tall, x : x + wide] = True
    columns = np.arange(width) - np.nan_to_num(sample.disparity)
    matched = np.clip(np.rint(columns), 0, width - 1).astype(np.intp)
    hidden = erased[np.arange(height)[:, None], matched] & np.isfinite(sample.disparity)
    return replace(sample, right=right, seen=sample.seen & ~hidden)
