"""Looks spots up in both eyes, in all directions, to see whether the eyes belong together.

A good pair's spots lie on one row, further left in the right eye. Swapped eyes
show them further right; eyes of different moments show them on other rows, the
nearer the farther off, or not at all; turned eyes move all of them alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import ImageU8, Region

Array = npt.NDArray[np.float64]

COARSE = 4
"""Resolution of the first search is a fourth."""
PATCH_PX, FINE_PATCH_PX = 19, 41
"""Side of a spot at the coarse and at the full resolution."""
REACH_X, REACH_Y = 110, 12
"""Of the coarse search, in coarse px: 440 by 48 px."""
FINE_REACH_PX = 6
SPOTS = 24
MIN_SCORE, MIN_FINE_SCORE = 0.75, 0.8
"""Normalised correlation of a spot that was found again."""
MIN_SPOTS = 8
PARALLAX_GAIN = 0.6
"""How much better than a turned eye a moved camera must explain the rows."""


@dataclass(frozen=True, slots=True, eq=False)
class EyeMatches:
    """Spots that both eyes see."""

    looked_for: int
    shifts_px: Array
    """(N, 2): left minus right position, x and y, of the spots that were found."""

    @property
    def found_share(self) -> float:
        return len(self.shifts_px) / max(self.looked_for, 1)

    @property
    def swapped_share(self) -> float:
        """Share of the found spots that lie further right in the right eye."""
        return float((self.shifts_px[:, 0] < 0).mean()) if len(self.shifts_px) else 0.0

    @property
    def rows_px(self) -> float | None:
        """Median offset of the rows, left minus right; None without spots."""
        return float(np.median(self.shifts_px[:, 1])) if len(self.shifts_px) else None

    @property
    def rows_spread_px(self) -> float | None:
        """Median deviation from the median offset of the rows."""
        if not len(self.shifts_px):
            return None
        return float(np.median(np.abs(self.shifts_px[:, 1] - np.median(self.shifts_px[:, 1]))))

    @property
    def nearer_is_farther_off(self) -> bool:
        """Whether the rows' offset grows with the disparity, as when the camera moved.

        An eye that turned on its mount shifts near and far things alike.
        """
        ahead = self.shifts_px[self.shifts_px[:, 0] > 0]
        if len(ahead) < MIN_SPOTS:
            return False
        slope = np.median(ahead[:, 1] / ahead[:, 0])
        as_moved = np.median(np.abs(ahead[:, 1] - slope * ahead[:, 0]))
        as_turned = np.median(np.abs(ahead[:, 1] - np.median(ahead[:, 1])))
        return bool(as_moved < PARALLAX_GAIN * as_turned)


def match_eyes(left: ImageU8, right: ImageU8, region: Region) -> EyeMatches:
    """Match spots of a region of the left eye; both images (H, W) grey."""
    size = (left.shape[1] // COARSE, left.shape[0] // COARSE)
    small = [
        np.asarray(cv2.resize(i, size, interpolation=cv2.INTER_AREA), np.uint8)
        for i in (left, right)
    ]
    spots = _spots(small[0], region)
    found = [s for s in (_look_up(left, right, small, spot) for spot in spots) if s is not None]
    return EyeMatches(len(spots), np.array(found, np.float64).reshape(-1, 2))


def _spots(small: npt.NDArray[np.uint8], region: Region) -> list[tuple[int, int]]:
    """Places with texture, in coarse px."""
    half = PATCH_PX // 2
    inside = np.zeros(small.shape, np.uint8)
    rows, columns = (slice(s.start // COARSE, s.stop // COARSE) for s in region.slices)
    inside[rows, columns] = 1
    inside[:half], inside[-half:], inside[:, :half], inside[:, -half:] = 0, 0, 0, 0
    corners = cv2.goodFeaturesToTrack(small, SPOTS, 0.02, PATCH_PX * 0.6, mask=inside)
    return [] if corners is None else [(round(x), round(y)) for x, y in corners.reshape(-1, 2)]


def _look_up(
    left: ImageU8, right: ImageU8, small: list[npt.NDArray[np.uint8]], spot: tuple[int, int]
) -> tuple[float, float] | None:
    coarse = _best(small[0], small[1], spot, spot, PATCH_PX, (REACH_X, REACH_Y))
    if coarse is None or coarse[2] < MIN_SCORE:
        return None
    start = (spot[0] * COARSE, spot[1] * COARSE)
    guess = (round(coarse[0] * COARSE), round(coarse[1] * COARSE))
    fine = _best(left, right, start, guess, FINE_PATCH_PX, (FINE_REACH_PX, FINE_REACH_PX))
    if fine is None or fine[2] < MIN_FINE_SCORE:
        return None
    return start[0] - fine[0], start[1] - fine[1]


def _best(
    left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8], spot: tuple[int, int],
    guess: tuple[int, int], side: int, reach: tuple[int, int],
) -> tuple[float, float, float] | None:  # fmt: skip
    """Where (x, y) the right image looks most like the left one's spot, and how much."""
    half, (height, width) = side // 2, left.shape[:2]
    (x, y), (u, v) = spot, guess
    x0, x1 = max(u - reach[0] - half, 0), min(u + reach[0] + half + 1, width)
    y0, y1 = max(v - reach[1] - half, 0), min(v + reach[1] + half + 1, height)
    patch = left[max(y - half, 0) : y + half + 1, max(x - half, 0) : x + half + 1]
    if patch.shape != (side, side) or x1 - x0 < side or y1 - y0 < side:
        return None
    compared = cv2.matchTemplate(right[y0:y1, x0:x1], patch, cv2.TM_CCOEFF_NORMED)
    scores = np.asarray(compared, np.float32)
    row, column = np.unravel_index(int(scores.argmax()), scores.shape)
    down, across = _peak(scores[:, column], int(row)), _peak(scores[row], int(column))
    return x0 + half + across, y0 + half + down, float(scores[row, column])


def _peak(scores: npt.NDArray[np.float32], index: int) -> float:
    """The maximum's place between the samples, by a parabola."""
    if not 0 < index < len(scores) - 1:
        return float(index)
    before, here, after = (float(s) for s in scores[index - 1 : index + 2])
    bend = before - 2 * here + after
    return index + (0.5 * (before - after) / bend if bend < 0 else 0.0)
