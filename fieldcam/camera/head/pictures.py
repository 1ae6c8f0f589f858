"""What a head's own pictures say about light, and small ones to aim by. Pure numpy."""

from __future__ import annotations

import numpy as np

from fieldcam.images.pixels import BAYER_CELLS
from fieldcam.values import ImageU8, PixelFormat

PREVIEW_WIDTH_PX = 720
"""At most; a tag at 60 cm then still has about 40 px to a side."""
BLACK = 12.0
"""Mean grey value below which a picture may be one that the flash did not light."""
LIT = 1.5
"""So many times brighter than the light of the day alone is what the flash lit."""
GREY = 90.0
"""Mean grey value that the preview is steered to."""
LONGEST_PREVIEW_US, SHORTEST_PREVIEW_US = 50_000.0, 20.0
_MAX_STEP = 8.0
_STRIDE = 8


def brightness(image: ImageU8) -> float:
    """Mean grey value, 0 to 255, of a raw image (H, W) or (H, W, 3)."""
    # Both rows and columns of a mosaic's cell are in the sample.
    height, width = (length - length % _STRIDE for length in image.shape[:2])
    cells = image[:height, :width].reshape(height // 2, 2, width // 2, -1)
    return float(cells[:: _STRIDE // 2, :, :: _STRIDE // 2].mean())


def flash_fired(mean: float, ambient: float | None) -> bool:
    """Whether a picture of this brightness was lit.

    `ambient`: how bright the light of the day alone would have made it, where that is
    known. Only a picture that is as good as black is called unlit: to refuse one that
    could have been read costs more than to hand on one that the verdict finds too dark.
    """
    return mean >= BLACK or (ambient is not None and mean > LIT * ambient + 1)


def next_exposure_us(exposure_us: float, mean: float) -> float:
    """What brings the preview to GREY; the same where it is near it."""
    change = min(max(GREY / max(mean, 1.0), 1 / _MAX_STEP), _MAX_STEP)
    if 0.7 < change < 1.4:
        return exposure_us
    return min(max(exposure_us * change, SHORTEST_PREVIEW_US), LONGEST_PREVIEW_US)


def shrunk(image: ImageU8, pixel_format: PixelFormat) -> tuple[ImageU8, int]:
    """A small picture, (h, w) grey or (h, w, 3) RGB, and how many pixels make one of its own."""
    # A mosaic keeps its colours only where whole cells are skipped.
    step = 2 * max(1, -(-image.shape[1] // (2 * PREVIEW_WIDTH_PX)))
    places = BAYER_CELLS.get(pixel_format)
    if places is None:
        return np.ascontiguousarray(image[::step, ::step]), step
    height, width = (length - length % step for length in image.shape)
    whole = image[:height, :width]
    red, green, other, blue = (whole[row::step, column::step] for row, column in places)
    middle = (green.astype(np.uint16) + other) // 2
    return np.stack([red, middle.astype(np.uint8), blue], axis=-1), step
