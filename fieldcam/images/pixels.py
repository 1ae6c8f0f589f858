"""Sizes of images, and how colours lie in their pixels; numpy only, for the app's own process."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcam.errors import PairMismatch
from fieldcam.values import ImageU8, PixelFormat

Cell = tuple[int, int]
"""Row and column in a 2 x 2 cell of a mosaic."""

BAYER_CELLS: Mapping[PixelFormat, tuple[Cell, Cell, Cell, Cell]] = {
    PixelFormat.BAYER_RG8: ((0, 0), (0, 1), (1, 0), (1, 1)),
    PixelFormat.BAYER_GR8: ((0, 1), (0, 0), (1, 1), (1, 0)),
    PixelFormat.BAYER_GB8: ((1, 0), (0, 0), (1, 1), (0, 1)),
    PixelFormat.BAYER_BG8: ((1, 1), (0, 1), (1, 0), (0, 0)),
}
"""Where red, both greens and blue are in each cell."""


def as_rgb(image: ImageU8) -> ImageU8:
    """(H, W, 3) of an image (H, W) of one channel; one of three as it is."""
    return image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)


def mosaic(image: ImageU8, pixel_format: PixelFormat) -> ImageU8:
    """(H, W): what a sensor with this Bayer filter keeps of RGB (H, W, 3)."""
    kept = np.empty(image.shape[:2], np.uint8)
    for (row, column), channel in zip(BAYER_CELLS[pixel_format], (0, 1, 1, 2), strict=True):
        kept[row::2, column::2] = image[row::2, column::2, channel]
    return kept


def check_size(size_px: tuple[int, int], calibrated_px: tuple[int, int]) -> None:
    """Refuses an image whose width and height are not those of its calibration."""
    if size_px != calibrated_px:
        has, wants = (f"{width} x {height}" for width, height in (size_px, calibrated_px))
        raise PairMismatch(
            f"The image has {has} pixels, its calibration {wants}.",
            "Give the calibration of the camera that took it.",
        )
