"""What a set of views tells about a camera, and what it does not tell yet.

A lens is known only where a corner was seen, a focal length only from tilted boards,
and both eyes' turn only from several distances.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fieldcam.calibration.boards import Pixels
from fieldcam.calibration.poses import Pose, Tilt
from fieldcam.values import FARTHEST_MM, NEAREST_MM

CELLS = (4, 3)
"""Columns and rows that a picture is divided into. Within the working range, the left
eye's first column and the right eye's last show what the other eye does not see."""
ROW_WORDS = ("upper ", "", "lower ")
COLUMN_WORDS = ("left", "middle left", "middle right", "right")
LEAST_CORNERS = 4
"""In a cell, before it counts as seen."""
THIRD_MM = (FARTHEST_MM - NEAREST_MM) / 3
NEAR_MM, FAR_MM = NEAREST_MM + THIRD_MM, FARTHEST_MM - THIRD_MM
"""The working range in thirds: a view is needed nearer than the first, and beyond the second."""
TILTS = (Tilt.UPPER, Tilt.LOWER, Tilt.LEFT, Tilt.RIGHT)

Counts = npt.NDArray[np.intp]


class Cell(NamedTuple):
    """A part of one eye's picture."""

    eye: str
    """left or right"""
    row: int
    column: int

    @property
    def words(self) -> str:
        corner = self.row != 1 and self.column in (0, CELLS[0] - 1)
        name = f"{ROW_WORDS[self.row]}{COLUMN_WORDS[self.column]} {'corner' if corner else 'part'}"
        return f"in the {name} of the {self.eye} picture"


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """What was seen so far."""

    left: Counts
    """Corners by row and column of cells, in the left eye's picture."""
    right: Counts
    tilts: frozenset[Tilt]
    nearest_mm: float
    """Infinity without a view."""
    farthest_mm: float

    @property
    def missing_cells(self) -> tuple[Cell, ...]:
        """What an eye has not seen of the part that it shares with the other."""
        return tuple(
            Cell(eye, int(row), int(column) + first)
            for eye, counts, first in (
                ("left", self.left[:, 1:], 1),
                ("right", self.right[:, :-1], 0),
            )
            for row, column in np.argwhere(counts < LEAST_CORNERS)
        )

    @property
    def missing_tilts(self) -> tuple[Tilt, ...]:
        return tuple(tilt for tilt in TILTS if tilt not in self.tilts)

    @property
    def missing_distances(self) -> tuple[str, ...]:
        """In the words that `missing_words` has for them."""
        near = f"nearer ({NEAREST_MM / 10:.0f} to {NEAR_MM / 10:.0f} cm)"
        far = f"farther away ({FAR_MM / 10:.0f} to {FARTHEST_MM / 10:.0f} cm)"
        missing = (near, self.nearest_mm > NEAR_MM), (far, self.farthest_mm < FAR_MM)
        return tuple(words for words, is_missing in missing if is_missing)

    @property
    def missing_words(self) -> tuple[str, ...]:
        """All that is missing; each goes on after `hold the board`. Nothing where all is seen."""
        return tuple(word for words in self._missing for word in words)

    @property
    def next_words(self) -> tuple[str, ...]:
        """One thing of each sort that is missing, so that one view can give them all."""
        return tuple(words[0] for words in self._missing if words)

    @property
    def _missing(self) -> tuple[tuple[str, ...], ...]:
        return (
            tuple(cell.words for cell in self.missing_cells),
            self.missing_distances,
            tuple(f"with its {tilt}" for tilt in self.missing_tilts),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """One view: where its corners are, and how the board was held."""

    left_px: Pixels
    right_px: Pixels
    pose: Pose


def coverage(seen: Sequence[Seen], size_px: tuple[int, int]) -> Coverage:
    """Of pictures of this size (width, height)."""
    ranges_mm = [each.pose.range_mm for each in seen]
    return Coverage(
        left=_counts((each.left_px for each in seen), size_px),
        right=_counts((each.right_px for each in seen), size_px),
        tilts=frozenset(each.pose.tilt for each in seen if each.pose.tilt is not None),
        nearest_mm=min(ranges_mm, default=np.inf),
        farthest_mm=max(ranges_mm, default=0.0),
    )


def _counts(places: Iterable[Pixels], size_px: tuple[int, int]) -> Counts:
    counts = np.zeros(CELLS[::-1], np.intp)
    for places_px in places:
        column, row = (
            np.clip(places_px[:, i] * CELLS[i] // size_px[i], 0, CELLS[i] - 1).astype(np.intp)
            for i in (0, 1)
        )
        np.add.at(counts, (row, column), 1)
    return counts
