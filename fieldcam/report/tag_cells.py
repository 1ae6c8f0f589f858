"""The pattern of each tag of the family tag36h11, and of anything else made of cells."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

import cv2
import numpy as np

from fieldcam.values import ImageU8

CELLS = 8
"""Cells of the black square's side, border included."""


def dark_runs(tag_id: int) -> Iterator[tuple[int, int, int]]:
    """Row from above, first column from the left, and length of each run of black cells."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    # OpenCV draws the family upside down.
    cells = cv2.rotate(cv2.aruco.generateImageMarker(family, tag_id, CELLS), cv2.ROTATE_180)
    yield from runs_of(np.asarray(cells, np.uint8))


def runs_of(cells: ImageU8) -> Iterator[tuple[int, int, int]]:
    """The same of any picture (H, W) in which 0 is black."""
    for row, values in enumerate(cells):
        column = 0
        for light, run in groupby(bool(value) for value in values):
            length = len(list(run))
            if not light:
                yield row, column, length
            column += length
