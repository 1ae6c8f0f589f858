"""A drawn pair with a tag in it, to time the whole pipeline without a camera."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.images.pixels import as_rgb
from fieldcam.values import TAG_SIZE_MM, Calibration, StereoPair

TAG_ID = 17
RANGE_MM = 440.0
CAMERA = Calibration(1440, 1080, 1716.0, 720.0, 540.0, 60.0)
_QUIET_SHARE = 0.25
"""Width of the white margin around the tag's border, of its side."""


def drawn_pair() -> StereoPair:
    """A tag before a noisy wall, both at RANGE_MM, as both eyes would see them."""
    shift = round(CAMERA.disparity_px(RANGE_MM))
    width, height = CAMERA.width_px, CAMERA.height_px
    rng = np.random.default_rng(0)
    noise = rng.normal(110, 60, (height // 4, (width + shift) // 4))
    wall = cv2.resize(noise, (width + shift, height), interpolation=cv2.INTER_CUBIC)
    scene = np.clip(wall, 0, 255).astype(np.uint8)
    card = _card(round(CAMERA.px_per_mm(RANGE_MM) * TAG_SIZE_MM))
    x, y = width // 2, height // 2
    scene[y : y + len(card), x : x + len(card)] = card
    rgb = as_rgb(scene)
    # The right eye stands to the right, so it sees the same things further left.
    return StereoPair(rgb[:, :width].copy(), rgb[:, shift:].copy())


def _card(side_px: int) -> npt.NDArray[np.uint8]:
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    tag = cv2.aruco.generateImageMarker(family, TAG_ID, side_px)
    margin = round(_QUIET_SHARE * side_px)
    return np.pad(np.asarray(tag, np.uint8), margin, constant_values=235)
