"""Grey pictures, which tags, boards, sharpness and SGBM are read from."""

from __future__ import annotations

import cv2
import numpy as np

from fieldcam.values import ImageU8


def as_grey(image: ImageU8) -> ImageU8:
    """(H, W) luminance of an RGB image (H, W, 3); one of one channel as it is."""
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
