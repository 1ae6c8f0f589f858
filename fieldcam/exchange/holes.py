"""Whether an image lacks a part: damage fills it with one value, or repeats a row.

A card or a cable loses bytes in the order of the file, so that a hole runs on from row to
row and ends abruptly at both ends. What a lens sees as one value, a night sky or a
saturated card, fades into its neighbours or ends where it ends, not where rows do.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fieldcam.disk.image_headers import RAW_SUFFIXES
from fieldcam.values import BoolMask, ImageU8

MIN_BYTES = 2048
"""Four sectors: less than this hides no fruitlet."""
ABRUPT = 0.25
"""Share of the pixels beside a hole that differ from it; in a picture nearly none do."""
CUT_ABRUPT = 0.6
"""The same where the hole reaches the image's beginning or end, as the dark may."""
DIFFERENT = 2
"""Grey levels: more than what a smooth gradient changes from row to row."""
MIN_ROWS = 8
"""Of one content, one after the other."""
LIVELY = 0.5
"""Share of neighbouring pixels that differ in a picture; in a drawing few do."""


def torn_eyes(eyes: Mapping[str, tuple[Path, ImageU8]]) -> tuple[str, ...]:
    """The names of those that lack a part, each given as its file and its image (H, W[, 3])."""
    return tuple(name for name, (path, image) in eyes.items() if _is_torn(path, image))


def has_hole(image: ImageU8) -> bool:
    """Of (H, W) or (H, W, 3), as stored or developed; a black margin is no hole."""
    pixels = image.reshape(image.shape[0], image.shape[1], -1)
    return _has_repeated_rows(pixels) or any(
        _is_abrupt(pixels, start, end, ABRUPT)
        for start, end in _constant_runs(pixels)
        if start > 0 and end < pixels.shape[0] * pixels.shape[1]
    )


def is_cut_short(image: ImageU8) -> bool:
    """Whether the beginning or the end is missing; only of an image as the sensor gave it.

    A rectified one has black margins, and a sensor's own margin ends with a row.
    """
    height, width = image.shape[:2]
    pixels = image.reshape(height, width, -1)
    return any(
        _is_abrupt(pixels, start, end, CUT_ABRUPT)
        for start, end in _constant_runs(pixels)
        if (start == 0 and end % width) or (end == height * width and start % width)
    )


def _is_torn(path: Path, image: ImageU8) -> bool:
    # What is no raw image may have been rectified, or cut out, before it was stored.
    return has_hole(image) or (path.suffix.lower() in RAW_SUFFIXES and is_cut_short(image))


def _constant_runs(pixels: ImageU8) -> list[tuple[int, int]]:
    """First pixel, and the one behind the last, of each run that is long enough to judge."""
    flat = pixels.reshape(-1, pixels.shape[2])
    least = max(MIN_BYTES // pixels.shape[2], 2)
    # A run that is long enough holds two neighbours of every so many pixels.
    sampled = flat[:: least // 2]
    if not (sampled[1:] == sampled[:-1]).all(axis=1).any():
        return []
    same = np.ones(len(flat) - 1, np.bool_)
    for channel in range(pixels.shape[2]):
        same &= flat[1:, channel] == flat[:-1, channel]
    edges = np.flatnonzero(np.diff(same, prepend=False, append=False))
    starts, ends = edges[::2], edges[1::2] + 1
    long = ends - starts >= least
    return list(zip(starts[long].tolist(), ends[long].tolist(), strict=True))


def _is_abrupt(pixels: ImageU8, start: int, end: int, share: float) -> bool:
    """Whether what lies above its first row and below its last is something else.

    Of a hole over whole rows one end does: the other may lie in the dark.
    """
    flat, width = pixels.reshape(-1, pixels.shape[2]), pixels.shape[1]
    length = min(width, end - start)
    sides = []
    if start >= width:
        sides.append(flat[start - width : start - width + length])
    if end + width <= len(flat):
        sides.append(flat[end + width - length : end + width])
    off = [_differs(side, flat[start]) >= share for side in sides]
    return any(off) if end - start >= 2 * width else bool(off) and all(off)


def _differs(side: ImageU8, value: ImageU8) -> float:
    off = np.abs(side.astype(np.int16) - value.astype(np.int16)).max(axis=1)
    return float((off > DIFFERENT).mean())


def _has_repeated_rows(pixels: ImageU8) -> bool:
    """Rows that a transfer gave again; a Bayer filter's come in pairs."""
    rows = pixels.reshape(pixels.shape[0], -1)
    return any(_repeats(rows, apart) for apart in (1, 2))


def _repeats(rows: npt.NDArray[np.uint8], apart: int) -> bool:
    # Few columns do to see that no two rows are the same.
    few = rows[:, :: max(rows.shape[1] // 64, 1)]
    again = (few[apart:] == few[:-apart]).all(axis=1)
    if not _longest(again, MIN_ROWS):
        return False
    changed = rows[apart:] != rows[:-apart]
    lively = (rows[:, 1:] != rows[:, :-1]).mean(axis=1) >= LIVELY
    again = ~changed.any(axis=1) & lively[apart:]
    return _longest(again, MIN_ROWS) and float(changed.mean()) >= LIVELY


def _longest(marked: BoolMask, least: int) -> bool:
    """Whether so many in a row are marked."""
    edges = np.flatnonzero(np.diff(marked, prepend=False, append=False))
    return bool((edges[1::2] - edges[::2] >= least).any())
