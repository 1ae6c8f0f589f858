"""One pair for training, and the half-pixel bookkeeping that makes it smaller."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
Field = npt.NDArray[np.float32]
Flags = npt.NDArray[np.bool_]

AGREEMENT_PX = 1.0
"""Truth is taken where the source pixels around a sample differ by no more."""


@dataclass(frozen=True, slots=True, eq=False)
class StereoSample:
    """A pair with its truth, all of one size; right column = left column - disparity."""

    left: Image
    """(h, w, 3) RGB."""
    right: Image
    disparity: Field
    """(h, w) residual in px of this pair; NaN where not known."""
    seen: Flags
    """(h, w): the left pixel is visible in the right eye, if inside its picture."""
    decided: Flags
    """(h, w): `seen` is known."""
    fruit: Flags
    """(h, w): the pixel shows a fruitlet, whose disparity matters most."""


def sample_columns(x: Field, values: Field) -> Field:
    """Linear samples of `values` (h, w) along its rows at columns `x` (h, w), clamped."""
    last = values.shape[1] - 1
    x = np.clip(np.nan_to_num(x), 0, last)
    whole = np.minimum(x.astype(np.intp), last - 1)
    rows = np.arange(values.shape[0])[:, None]
    fraction = x - whole
    found = values[rows, whole] * (1 - fraction) + values[rows, whole + 1] * fraction
    return np.asarray(found, np.float32)


def _corners(size: int, factor: float, limit: int) -> tuple[npt.NDArray[np.intp], Field]:
    """Index of the pixel before, and the way to the next one, for each shrunk pixel."""
    at = np.clip(factor * (np.arange(size) + 0.5) - 0.5, 0, limit - 1.001)
    whole = at.astype(np.intp)
    return whole, (at - whole).astype(np.float32)


def shrink(sample: StereoSample, height: int, width: int) -> StereoSample:
    """The sample at `height` by `width`, images averaged over areas.

    The centre of shrunk pixel u lies at factor * (u + 0.5) - 0.5 in both eyes, so
    disparities are divided by the factor, and truth is read at that very place
    from the four pixels around it, where they agree.
    """
    full_height, full_width = sample.disparity.shape
    factor = full_width / width
    rows, down = _corners(height, full_height / height, full_height)
    columns, along = _corners(width, factor, full_width)
    around = [(rows[:, None] + i, columns[None, :] + j) for i in (0, 1) for j in (0, 1)]
    weights = [
        (down if i else 1 - down)[:, None] * (along if j else 1 - along)[None, :]
        for i in (0, 1)
        for j in (0, 1)
    ]
    four = np.stack([sample.disparity[at] for at in around])
    spread = four.max(axis=0) - four.min(axis=0)
    mean = np.sum(four * np.stack(weights), axis=0)
    agreed = np.where(spread <= AGREEMENT_PX, mean / factor, np.nan).astype(np.float32)
    seen = np.stack([sample.seen[at] for at in around])
    everywhere: Flags = np.all(seen, axis=0)
    nowhere: Flags = ~np.any(seen, axis=0)
    decided = np.stack([sample.decided[at] for at in around]).all(axis=0)
    decided &= nowhere | (everywhere & np.isfinite(agreed))
    return StereoSample(
        _averaged(sample.left, height, width),
        _averaged(sample.right, height, width),
        agreed,
        everywhere,
        decided,
        np.all([sample.fruit[at] for at in around], axis=0),
    )


def _averaged(image: Image, height: int, width: int) -> Image:
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8)


def mirrored_swap(sample: StereoSample) -> StereoSample:
    """The pair seen in a mirror: eyes change places, each turned left to right.

    What only the right eye saw has no truth here, and nothing is decided about it.

    The right eye's disparity is found by carrying the left eye's over, then
    refined by two rounds of x = x_right + disparity(x).
    """
    width = sample.disparity.shape[1]
    carried = _carry_over(sample)
    columns = np.arange(width, dtype=np.float32)
    refined = carried
    for _ in range(2):
        refined = sample_columns(columns + refined, sample.disparity)
    steady = np.abs(refined - carried) < AGREEMENT_PX
    disparity = np.where(steady, refined, np.nan)
    fruit = sample_columns(columns + refined, sample.fruit.astype(np.float32)) > 0.5
    turn = (slice(None), slice(None, None, -1))
    return StereoSample(
        np.ascontiguousarray(sample.right[turn]),
        np.ascontiguousarray(sample.left[turn]),
        np.ascontiguousarray(disparity[turn]),
        np.ascontiguousarray(steady[turn]),
        np.ascontiguousarray(steady[turn]),
        np.ascontiguousarray((fruit & steady)[turn]),
    )


def _carry_over(sample: StereoSample) -> Field:
    """(h, w) disparity of the right eye's pixels, the nearest surface winning; NaN elsewhere."""
    height, width = sample.disparity.shape
    rows, columns = np.nonzero(sample.seen & np.isfinite(sample.disparity))
    values = sample.disparity[rows, columns]
    targets = np.rint(columns - values).astype(np.intp)
    inside = (targets >= 0) & (targets < width)
    flat = np.full(height * width, -np.inf, np.float32)
    np.maximum.at(flat, rows[inside] * width + targets[inside], values[inside])
    return np.where(np.isfinite(flat), flat, np.nan).reshape(height, width).astype(np.float32)
