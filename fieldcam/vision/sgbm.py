"""Semi-global block matching: the paper's baseline (Hirschmüller 2008)."""

from __future__ import annotations

import math

import cv2
import numpy as np
from fieldcam.vision.stereo.matching import gray

from fieldcam.values import FloatMap, ImageU8

BLOCK_PX = 3
P1 = 216
P2 = 864
"""Smoothness penalties of the authors' settings; their node reads but never applies them."""
SUBPIXELS = 16


class SgbmMatcher:
    """OpenCV's matcher with the authors' settings, on grey images at full resolution."""

    def __init__(self, search_px: float = 64.0) -> None:
        self._search_px = search_px
        half = math.ceil(search_px / 8) * 8
        self._lowest = -half
        self._matcher = cv2.StereoSGBM.create(
            minDisparity=-half,
            numDisparities=2 * half,
            blockSize=BLOCK_PX,
            P1=P1,
            P2=P2,
            disp12MaxDiff=1,
            preFilterCap=63,
            uniquenessRatio=10,
            speckleWindowSize=100,
            speckleRange=2,
            mode=cv2.STEREO_SGBM_MODE_SGBM,
        )

    @property
    def scale(self) -> float:
        return 1.0

    @property
    def search_px(self) -> float:
        return self._search_px

    def spanning(self, search_px: float) -> SgbmMatcher:
        return SgbmMatcher(search_px)

    def match(self, left: ImageU8, right: ImageU8) -> FloatMap:
        """Residual disparity (H, W) in pixels; NaN where no match is unique."""
        margin = -self._lowest
        # The matcher leaves a strip as wide as its window empty at both sides.
        padded = [
            cv2.copyMakeBorder(gray(eye), 0, 0, margin, margin, cv2.BORDER_REPLICATE)
            for eye in (left, right)
        ]
        fixed = self._matcher.compute(padded[0], padded[1])[:, margin:-margin]
        disparity = fixed.astype(np.float32) / SUBPIXELS
        known = (disparity >= self._lowest) & (np.abs(disparity) <= self._search_px)
        return np.where(known, disparity, np.nan).astype(np.float32)
