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
from fieldcam.calibration.poses import BoardPose, Tilt
from fieldcam.values import FARTHEST_MM, NEAREST_MM

COLUMN_EDGES, ROW_EDGES = (0.0, 0.2, 0.5, 0.8, 1.0), (0.0, 0.25, 0.75, 1.0)
"""Of the cells that a picture is divided into, in widths and heights of it. The outer ones
are narrow, since lenses bend most there. Within the working range, the left eye's first
column and the right eye's last show what the other eye does not see."""
ROW_WORDS = ("upper ", "", "lower ")
COLUMN_WORDS = ("left", "middle left", "middle right", "right")
MIN_CORNERS = 4
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
        corner = self.row != 1 and self.column in (0, len(COLUMN_WORDS) - 1)
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
            for row, column in np.argwhere(counts < MIN_CORNERS)
        )

    @property
    def missing_tilts(self) -> tuple[Tilt, ...]:
        return tuple(tilt for tilt in TILTS if tilt not in self.tilts)

    @property
    def missing_distances(self) -> tuple[str, ...]:
        """In the words that `missing_words` has for them."""
        near = f"closer ({NEAREST_MM / 10:.0f} to {NEAR_MM / 10:.0f} cm)"
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
class SeenBoard:
    """One view: where its corners are, and how the board was held."""

    left_px: Pixels
    right_px: Pixels
    pose: BoardPose


def coverage(seen: Sequence[SeenBoard], size_px: tuple[int, int]) -> Coverage:
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
    counts = np.zeros((len(ROW_WORDS), len(COLUMN_WORDS)), np.intp)
    for places_px in places:
        x, y = (places_px / size_px).T
        # By the inner edges: what lies beyond the picture belongs to its outer cells.
        row, column = np.digitize(y, ROW_EDGES[1:-1]), np.digitize(x, COLUMN_EDGES[1:-1])
        np.add.at(counts, (row, column), 1)
    return counts
