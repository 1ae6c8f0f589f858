"""Whether an image lacks a part: damage fills it with one value or a pattern, or repeats a row.

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

Values = npt.NDArray[np.uint8]
Run = tuple[int, int]
"""The first value, and the one behind the last, as they lie in the file."""

MIN_BYTES = 2048
"""Four sectors: less than this hides no fruitlet."""
PERIOD = 48
"""Bytes: a fill of 1, 2, 4, 8 or 16, or a pixel of 3, comes again after so many."""
ABRUPT = 0.05
"""Share of the values beside a hole that differ from it; in whole pictures, darkened until half
of each is black or lightened until much of it is white, 0.031 at most do."""
FADING = 0.75
"""Where a lens sees the dark begin, each row differs in fewer values than the one beyond it."""
DIFFERENT = 2
"""Grey levels: more than what a smooth gradient changes from row to row."""
MAX_MARGIN_ROWS = 64
"""Of a sensor, at the beginning or end of its image."""
MIN_ROWS = 8
"""Of one content, one after the other."""
LIVELY = 0.5
"""Share of neighbouring values that differ in a picture; in a drawing few do."""
MIN_TELLING = 32
"""Values of a row; fewer that are neither black nor white say nothing about it."""


def torn_eyes(eyes: Mapping[str, tuple[Path, ImageU8]]) -> tuple[str, ...]:
    """The names of those that lack a part, each given as its file and its image (H, W[, 3])."""
    return tuple(name for name, (path, image) in eyes.items() if _is_torn(path, image))


def has_hole(image: ImageU8) -> bool:
    """Of (H, W) or (H, W, 3), as stored or developed; a black margin is no hole."""
    rows = _stored_rows(image)
    return _has_repeated_rows(rows) or any(
        _is_abrupt(rows, run) for run in _repeating_runs(rows) if run[0] > 0 and run[1] < rows.size
    )


def is_cut_short(image: ImageU8) -> bool:
    """Whether the beginning or the end is missing; only of an image as the sensor gave it.

    A rectified one has black margins, and a sensor's own margin is narrow and ends with a row.
    """
    rows = _stored_rows(image)
    return any(
        _is_abrupt(rows, run) and not _is_margin(rows, run)
        for run in _repeating_runs(rows)
        if run[0] == 0 or run[1] == rows.size
    )


def _is_torn(path: Path, image: ImageU8) -> bool:
    # What is no raw image may have been rectified, or cut out, before it was stored.
    return has_hole(image) or (path.suffix.lower() in RAW_SUFFIXES and is_cut_short(image))


def _stored_rows(image: ImageU8) -> Values:
    """(H, bytes of a row): grey that was read as colour is one value a pixel in its file."""
    if image.ndim == 3 and (image == image[..., :1]).all():
        image = image[..., 0]
    return np.ascontiguousarray(image).reshape(image.shape[0], -1)


def _repeating_runs(rows: Values) -> list[Run]:
    """Where a fill comes again and again, for long enough to judge."""
    flat = rows.reshape(-1)
    blocks = flat[: len(flat) // PERIOD * PERIOD].reshape(-1, PERIOD)
    # Each run holds so many blocks that are the same; pictures with any are few.
    if not _longest((blocks[1:] == blocks[:-1]).all(axis=1), MIN_BYTES // PERIOD - 2):
        return []
    starts, ends = _stretches(flat[PERIOD:] == flat[:-PERIOD])
    ends += PERIOD
    long = ends - starts >= MIN_BYTES
    return list(zip(starts[long].tolist(), ends[long].tolist(), strict=True))


def _is_abrupt(rows: Values, run: Run) -> bool:
    """Whether what lies above its first row and below its last is something else.

    Of a hole over whole rows one end does: the other may lie in the dark.
    """
    start, end = run
    width = rows.shape[1]
    length = min(width, end - start)
    above = (start - width, start - 2 * width)
    below = (end - length + width, end - length + 2 * width)
    abrupt = [
        _ends_at_once(length, *(_differing(rows, run, first, length) for first in beside))
        for beside in (above, below)
        if 0 <= beside[0] <= rows.size - length
    ]
    return any(abrupt) if end - start >= 2 * width else bool(abrupt) and all(abrupt)


def _ends_at_once(length: int, beside: int, beyond: int) -> bool:
    return beside >= ABRUPT * length and beside >= FADING * beyond


def _differing(rows: Values, run: Run, first: int, length: int) -> int:
    """How many values from `first` on the run, going on there, would not have.

    Those of a drawing, which repeat themselves, are none: its figures end with a row.
    """
    flat = rows.reshape(-1)
    places = np.arange(max(first, 0), min(first + length, len(flat)))
    filled = flat[run[0] + (places - run[0]) % PERIOD].astype(np.int16)
    differ = np.abs(flat[places] - filled) > DIFFERENT
    return int((differ & (flat[places] != flat[places - PERIOD])).sum())


def _is_margin(rows: Values, run: Run) -> bool:
    """Whether it may end with a row: a picture's own dark may join the margin to the row's end."""
    start, end = run
    width = rows.shape[1]
    if end - start > MAX_MARGIN_ROWS * width:
        return False
    if start == 0:
        inside = _differing(rows, run, end - end % width + width, end % width)
    else:
        inside = _differing(rows, run, start - width, -start % width)
    return inside < MIN_TELLING


def _has_repeated_rows(rows: Values) -> bool:
    """Rows that a transfer gave again; a Bayer filter's come in pairs."""
    return any(_repeats(rows, apart) for apart in (1, 2))


def _repeats(rows: Values, apart: int) -> bool:
    # Few columns do to see that no two rows are the same.
    few = rows[:, :: max(rows.shape[1] // 64, 1)]
    again = (few[apart:] == few[:-apart]).all(axis=1)
    if not _longest(again, MIN_ROWS):
        return False
    changed = rows[apart:] != rows[:-apart]
    # Black stays black and white stays white, whatever the noise.
    telling = (rows > 0) & (rows < 255)
    lively = _share((rows[:, 1:] != rows[:, :-1]).sum(axis=1), telling.sum(axis=1))
    again = ~changed.any(axis=1) & (lively[apart:] >= LIVELY)
    return _longest(again, MIN_ROWS) and changed.sum() >= LIVELY * telling[apart:].sum()


def _share(of: npt.NDArray[np.int64], telling: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """None of a row that says nothing."""
    return np.where(telling >= MIN_TELLING, of / np.maximum(telling, 1), 0.0)


def _longest(marked: BoolMask, least: int) -> bool:
    """Whether so many in a row are marked."""
    starts, ends = _stretches(marked)
    return bool((ends - starts >= least).any())


def _stretches(marked: BoolMask) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """The first of each stretch of marked ones, and the one behind its last."""
    edges = np.flatnonzero(np.diff(marked, prepend=False, append=False))
    return edges[::2], edges[1::2]
