"""Arrays as short JSON values: masks as run lengths, maps and clouds as packed text.

Packed text is base64 of zlib of small integers. Every decoder knows from the
JSON around it how many bytes must come out, and refuses any other number: a
damaged or hostile text cannot fill the memory.
"""

from __future__ import annotations

import base64
import math
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldcam.foreign.bounds import MAX_PIXELS
from fieldcam.values import BoolMask, FloatMap, Points

DISPARITY_STEPS_PER_PX = 64
CLOUD_STEPS_PER_MM = 100

UNKNOWN = 0
"""Stored in place of a disparity that is not known."""

LARGEST_STORED = int(np.iinfo(np.uint16).max)

COMPRESSION_LEVEL = 3
"""Above it zlib takes several times longer for a few per cent."""


def encode_mask(window: BoolMask) -> list[int]:
    """Run lengths by rows of a mask (h, w); the first counts background and may be 0."""
    flat = np.concatenate(([False], window.ravel()))
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    edges = np.concatenate(([0], changes, [window.size]))
    return [int(length) for length in np.diff(edges)]


def decode_mask(runs: list[int], width: int, height: int) -> BoolMask:
    """(height, width) bool."""
    size = _checked_pixels(width, height)
    lengths = np.array(runs, dtype=np.int64)
    if lengths.ndim != 1 or (lengths < 0).any() or (lengths > size).any() or lengths.sum() != size:
        raise ValueError("the runs of a mask do not fill its window")
    foreground = np.arange(lengths.size) % 2 == 1
    return np.repeat(foreground, lengths).reshape(height, width)


def encode_disparity(disparity_px: FloatMap) -> dict[str, Any]:
    """An (H, W) map in steps of 1/64 px, counted from its smallest whole value.

    A map that spans more than 1023 px, which no camera of ours gives, is stored
    in coarser steps.
    """
    known = np.isfinite(disparity_px)
    lowest = _floor_of_stored(float(disparity_px[known].min())) if known.any() else 0
    span = float(disparity_px[known].max()) - lowest if known.any() else 0.0
    steps_per_px = min(DISPARITY_STEPS_PER_PX, (LARGEST_STORED - 1) / max(span, 1.0))
    above = np.where(known, disparity_px.astype(np.float64) - lowest, 0.0)
    steps = np.where(known, np.rint(above * steps_per_px) + 1, UNKNOWN).astype(np.uint16)
    return {
        "width": disparity_px.shape[1],
        "height": disparity_px.shape[0],
        "lowest_px": lowest,
        "steps_per_px": steps_per_px,
        "steps": _pack(_split_bytes(_differences(steps))),
    }


def _floor_of_stored(disparity_px: float) -> int:
    # Rounded to a step first: else -0.004 is stored as 0 above -1, and is 0 above 0
    # when the map that came back is written again.
    return math.floor(round(disparity_px * DISPARITY_STEPS_PER_PX) / DISPARITY_STEPS_PER_PX)


def decode_disparity(
    text: str, width: int, height: int, lowest_px: float, steps_per_px: float
) -> FloatMap:
    """(height, width) float32, NaN where unknown."""
    if not steps_per_px > 0:
        raise ValueError("a disparity map has no step")
    size = _checked_pixels(width, height)
    halves = np.frombuffer(_unpack(text, 2 * size), np.uint8).reshape(2, height, width)
    steps = _sums(halves[0].astype(np.uint16) << 8 | halves[1])
    disparity_px = lowest_px + (steps.astype(np.float64) - 1) / steps_per_px
    return np.where(steps == UNKNOWN, np.nan, disparity_px).astype(np.float32)


def encode_cloud(cloud_mm: Points) -> str:
    """An (N, 3) cloud in steps of 0.01 mm."""
    steps = np.rint(cloud_mm.astype(np.float64) * CLOUD_STEPS_PER_MM).astype("<i4")
    return _pack(np.ascontiguousarray(steps.T).tobytes())


def decode_cloud(text: str, points: int) -> Points:
    """(points, 3) float32, mm."""
    if not 0 <= points <= MAX_PIXELS:
        raise ValueError("a cloud has an impossible number of points")
    steps = np.frombuffer(_unpack(text, points * 12), "<i4").reshape(3, points)
    return np.ascontiguousarray(steps.T / CLOUD_STEPS_PER_MM).astype(np.float32)


def _checked_pixels(width: int, height: int) -> int:
    if width < 0 or height < 0 or width * height > MAX_PIXELS:
        raise ValueError("a window has an impossible size")
    return width * height


def _differences(steps: npt.NDArray[np.uint16]) -> npt.NDArray[np.uint16]:
    """Each value less its neighbours' plane; wraps around, as `_sums` does."""
    across = np.diff(steps, axis=1, prepend=np.uint16(0))
    return np.diff(across, axis=0, prepend=np.uint16(0))


def _sums(differences: npt.NDArray[np.uint16]) -> npt.NDArray[np.uint16]:
    down = np.cumsum(differences, axis=0, dtype=np.uint16)
    return np.cumsum(down, axis=1, dtype=np.uint16)


def _split_bytes(values: npt.NDArray[np.uint16]) -> bytes:
    """All high bytes, then all low ones: the high ones nearly vanish."""
    return (values >> 8).astype(np.uint8).tobytes() + values.astype(np.uint8).tobytes()


def _pack(data: bytes) -> str:
    return base64.b64encode(zlib.compress(data, COMPRESSION_LEVEL)).decode("ascii")


def _unpack(text: str, size: int) -> bytes:
    """Exactly `size` bytes."""
    unzipper = zlib.decompressobj()
    data = unzipper.decompress(base64.b64decode(text, validate=True), size + 1)
    if len(data) != size or not unzipper.eof:
        raise ValueError("packed data has the wrong length")
    return data
