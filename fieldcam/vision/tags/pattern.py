"""What a tag of the family tag36h11 looks like."""

from __future__ import annotations

import cv2
import numpy as np

from fieldcam.values import ImageU8

CELLS = 8
"""Cells of the black square's side, border included."""


def tag_cells(tag_id: int) -> ImageU8:
    """(8, 8): 0 where the upright tag is black, 255 where it is white."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    # OpenCV draws the family upside down.
    return np.rot90(np.asarray(cv2.aruco.generateImageMarker(family, tag_id, CELLS), np.uint8), 2)
