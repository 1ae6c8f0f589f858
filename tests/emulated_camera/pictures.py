"""What the eyes see, and how exposure, gain and light make an image of it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
"""(H, W) uint8, one colour a pixel in the pattern RG over GB."""
PictureSource = Callable[[int], tuple[Image, Image]]
"""What the left and the right eye see at the n-th exposure, under the flash at NOMINAL_US.

Giving the same arrays again saves developing them again; nobody may write to them.
"""

NOMINAL_US = 300.0
"""So much light of the flash, at no gain, gives the picture as the source has it."""
AMBIENT = 0.02
"""Of the light of the flash there is without it."""
_KEPT = 16


@dataclass(frozen=True, slots=True)
class Development:
    """What turns light into numbers."""

    brightness: float
    """1 leaves the picture as it is."""
    black_level: float = 0.0
    red: float = 1.0
    blue: float = 1.0
    """White balance, relative to green."""


class Darkroom:
    """Develops pictures, and keeps the last ones, since many exposures are alike."""

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[int, Development], tuple[Image, Image]] = OrderedDict()

    def develop(self, picture: Image, development: Development) -> Image:
        key = (id(picture), development)
        if key not in self._kept:
            # The picture is kept too, so that its identity stays taken.
            self._kept[key] = (picture, _developed(picture, development))
            if len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key][1]


def _developed(picture: Image, development: Development) -> Image:
    red, green, blue = (
        _curve(development.brightness * gain, development.black_level)
        for gain in (development.red, 1.0, development.blue)
    )
    found = np.asarray(cv2.LUT(picture, green), np.uint8)
    for place, curve in (((0, 0), red), ((1, 1), blue)):
        if not np.array_equal(curve, green):
            pixels = np.ascontiguousarray(picture[place[0] :: 2, place[1] :: 2])
            found[place[0] :: 2, place[1] :: 2] = cv2.LUT(pixels, curve)
    found.flags.writeable = False
    return found


def _curve(gain: float, black_level: float) -> Image:
    levels = np.arange(256) * gain + black_level
    return np.asarray(np.clip(np.rint(levels), 0, 255), np.uint8)


def gradients(width_px: int, height_px: int, disparity_px: int = 96) -> PictureSource:
    """Smooth colours with fine texture, the right eye's shifted left by the disparity.

    Each exposure is brighter by one grey value than the one before, modulo 8, so
    that pictures of two exposures differ.
    """
    wide = _scene(width_px + disparity_px, height_px)
    kept: dict[int, tuple[Image, Image]] = {}

    def source(ordinal: int) -> tuple[Image, Image]:
        step = ordinal % 8
        if step not in kept:
            scene = wide + np.uint8(step)
            kept[step] = (
                np.ascontiguousarray(scene[:, :width_px]),
                np.ascontiguousarray(scene[:, disparity_px:]),
            )
        return kept[step]

    return source


def _scene(width_px: int, height_px: int) -> Image:
    rng = np.random.default_rng(1)
    rows, columns = np.mgrid[0:height_px, 0:width_px]
    smooth = 90 + 50 * np.sin(columns / 67) * np.cos(rows / 41)
    texture = rng.integers(-24, 25, (height_px, width_px))
    return np.asarray(np.clip(smooth + texture, 8, 200), np.uint8)


def mosaic(image: npt.NDArray[np.uint8]) -> Image:
    """(H, W) uint8: what a sensor with the pattern RG over GB sees of (H, W, 3) RGB."""
    found = image[..., 1].copy()
    found[0::2, 0::2] = image[0::2, 0::2, 0]
    found[1::2, 1::2] = image[1::2, 1::2, 2]
    return found
