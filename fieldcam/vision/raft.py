"""The RAFT-Stereo graph as a stereo matcher (paper section III-D)."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from fieldcam.vision.stereo.matching import resized

from fieldcam.values import BoolMask, FloatMap, ImageU8
from fieldcam.vision.onnx_session import Network, OnnxModel, Signature, network_image

SIGNATURE = Signature(frozenset({"left", "right"}), frozenset({"disparity", "confidence"}))
COARSEST = 0.125
FINEST = 2.0
"""Limits of the resolution that a window may ask for."""
EDGE_STEP_PX = 1.0
"""Neighbouring disparities further apart than this are not blended when enlarged."""


class RaftMatcher:
    """RAFT-Stereo: `scale` shrinks the crops, `network_search_px` bounds its own pixels."""

    def __init__(
        self, model: Network, network_search_px: float, multiple: int, scale: float = 0.5
    ) -> None:
        self._model = model
        self._network_search_px = network_search_px
        self._multiple = multiple
        self._scale = scale

    @classmethod
    def from_file(
        cls, path: Path, network_search_px: float, multiple: int, scale: float = 0.5
    ) -> RaftMatcher:
        """A matcher for a network's file and what the manifest says about it."""
        return cls(OnnxModel(path, SIGNATURE), network_search_px, multiple, scale)

    @property
    def scale(self) -> float:
        return self._scale

    @property
    def search_px(self) -> float:
        return self._network_search_px / self._scale

    def warm_up(self) -> None:
        self._model.warm_up()

    def spanning(self, search_px: float) -> RaftMatcher:
        """The same network at the resolution where its window spans ±search_px."""
        scale = float(np.clip(self._network_search_px / search_px, COARSEST, FINEST))
        return RaftMatcher(self._model, self._network_search_px, self._multiple, scale)

    def match(self, left: ImageU8, right: ImageU8) -> FloatMap:
        """Residual disparity (H, W) in pixels of the crops; NaN where unknown."""
        height, width = left.shape[:2]
        small = (max(round(width * self._scale), 1), max(round(height * self._scale), 1))
        output = self._model.run(
            {
                "left": self._input(resized(left, small)),
                "right": self._input(resized(right, small)),
            }
        )
        residual = output["disparity"][0, 0, : small[1], : small[0]]
        matched = output["confidence"][0, 0, : small[1], : small[0]] >= 0
        matched &= np.abs(residual) <= self._network_search_px
        # What would have matched outside the right crop was never compared.
        columns = np.arange(small[0])[None, :] - residual
        matched &= (columns > -0.5) & (columns < small[0] - 0.5)
        return enlarged(residual * (width / small[0]), matched, (width, height))

    def _input(self, image: ImageU8) -> npt.NDArray[np.float32]:
        """(1, 3, h, w) float32 with border pixels repeated up to the graph's multiple."""
        height, width = image.shape[:2]
        below, beside = -height % self._multiple, -width % self._multiple
        padded = cv2.copyMakeBorder(image, 0, below, 0, beside, cv2.BORDER_REPLICATE)
        return network_image(np.asarray(padded, dtype=np.uint8))[None]


def enlarged(disparity: FloatMap, known: BoolMask, size: tuple[int, int]) -> FloatMap:
    """A disparity map at another (width, height), pixel centres kept in place.

    Linear inside a surface, nearest across an edge and beside unknown pixels;
    NaN where the nearest pixel is unknown. Values are not rescaled.
    """
    filled = np.where(known, disparity, 0).astype(np.float32)
    weight = cv2.resize(known.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
    nearest_known = _nearest(known.astype(np.float32), size) > 0.5
    linear = cv2.resize(filled, size, interpolation=cv2.INTER_LINEAR) / np.maximum(weight, 1e-6)
    nearest = _nearest(filled, size)
    smooth = (np.abs(linear - nearest) < EDGE_STEP_PX) & (weight > 0.25)
    return np.where(nearest_known, np.where(smooth, linear, nearest), np.nan).astype(np.float32)


def _nearest(values: FloatMap, size: tuple[int, int]) -> FloatMap:
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_NEAREST_EXACT), np.float32)
