"""Turns raw pairs into rectified ones."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from fieldcam.calibration.rig import EyeLens, StereoRig
from fieldcam.images.pixels import check_size
from fieldcam.values import FloatMap, ImageU8, PixelFormat, RawPair, StereoPair

DEMOSAIC = {
    PixelFormat.MONO8: cv2.COLOR_GRAY2RGB,
    PixelFormat.BAYER_RG8: cv2.COLOR_BayerRGGB2RGB_EA,
    PixelFormat.BAYER_GB8: cv2.COLOR_BayerGBRG2RGB_EA,
    PixelFormat.BAYER_GR8: cv2.COLOR_BayerGRBG2RGB_EA,
    PixelFormat.BAYER_BG8: cv2.COLOR_BayerBGGR2RGB_EA,
}

Maps = tuple[FloatMap, FloatMap]


def demosaic(image: ImageU8, pixel_format: PixelFormat) -> ImageU8:
    """RGB (H, W, 3) from an image as the camera gave it."""
    if pixel_format is PixelFormat.RGB8:
        return image
    return np.asarray(cv2.cvtColor(image, DEMOSAIC[pixel_format]), np.uint8)


def develop(raw: RawPair) -> StereoPair:
    """Both eyes in colour, not yet rectified."""
    return StereoPair(demosaic(raw.left, raw.pixel_format), demosaic(raw.right, raw.pixel_format))


class Rectifier:
    """Rectifies the pairs of one raw camera; its maps are worked out once."""

    def __init__(self, rig: StereoRig) -> None:
        self.rig = rig
        self._left = _maps(rig.left, rig.size_px)
        self._right = _maps(rig.right, rig.size_px)

    def rectify(self, pair: StereoPair) -> StereoPair:
        """The pair as the rectified camera would have seen it; black where it sees nothing."""
        for image in (pair.left, pair.right):
            check_size((image.shape[1], image.shape[0]), self.rig.size_px)
        return replace(
            pair, left=_remap(pair.left, self._left), right=_remap(pair.right, self._right)
        )


def _maps(eye: EyeLens, size_px: tuple[int, int]) -> Maps:
    columns, rows = cv2.initUndistortRectifyMap(
        eye.camera_matrix, eye.distortion, eye.rotation, eye.projection, size_px, cv2.CV_32FC1
    )
    return np.asarray(columns, np.float32), np.asarray(rows, np.float32)


def _remap(image: ImageU8, maps: Maps) -> ImageU8:
    # Cubic, because linear interpolation blurs the edges that sizes are read from.
    return np.asarray(cv2.remap(image, *maps, cv2.INTER_CUBIC), np.uint8)
