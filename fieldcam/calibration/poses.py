"""How a board was held: how far away, and which of its edges was nearer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np

from fieldcam.calibration.boards import Pixels
from fieldcam.calibration.reading.documents import Array

USUAL_FOCAL = 1.2
"""Focal length of a stereo head's lens in widths of its picture, before it is known."""
FLAT_DEG, TILTED_DEG = 10.0, 15.0


class Tilt(StrEnum):
    """Which edge of the board, as it is seen, is nearer to the camera."""

    FLAT = "flat"
    UPPER = "upper edge nearer"
    LOWER = "lower edge nearer"
    LEFT = "left edge nearer"
    RIGHT = "right edge nearer"


@dataclass(frozen=True, slots=True, eq=False)
class BoardPose:
    """Where a board is in an eye's frame: points become turn @ point + place."""

    turn: Array
    """(3, 3)"""
    place_mm: Array
    """(3,)"""
    middle_mm: Array
    """(3,): of the corners that are seen."""

    @property
    def range_mm(self) -> float:
        return float(self.middle_mm[2])

    @property
    def normal(self) -> Array:
        """(3,): unit length, towards the camera."""
        normal = self.turn[:, 2]
        return -normal if normal @ self.middle_mm > 0 else normal

    @property
    def tilt_deg(self) -> float:
        """Between the board's normal and the way to the camera's plane."""
        return math.degrees(math.acos(min(1.0, abs(float(self.normal[2])))))

    @property
    def tilt(self) -> Tilt | None:
        """None between flat and tilted."""
        if self.tilt_deg < FLAT_DEG:
            return Tilt.FLAT
        if self.tilt_deg < TILTED_DEG:
            return None
        x, y, _ = self.normal
        if abs(x) > abs(y):
            return Tilt.RIGHT if x < 0 else Tilt.LEFT
        return Tilt.LOWER if y < 0 else Tilt.UPPER


def board_pose(board_mm: Pixels, turn: Array, place_mm: Array) -> BoardPose:
    """`turn`: (3,) rotation vector, or anything that reshapes to it, as is `place_mm`."""
    matrix = np.asarray(cv2.Rodrigues(turn.reshape(3))[0], np.float64)
    place = place_mm.reshape(3)
    return BoardPose(matrix, place, matrix @ board_mm.mean(axis=0) + place)


def find_pose(
    board_mm: Pixels, places_px: Pixels, camera_matrix: Array, distortion: Array
) -> BoardPose | None:
    """The pose that explains corners (N, 3) seen at (N, 2) best; None where none does."""
    try:
        found, turn, place = cv2.solvePnP(board_mm, places_px, camera_matrix, distortion)
    except cv2.error:
        return None
    if not found:
        return None
    return board_pose(board_mm, np.asarray(turn, np.float64), np.asarray(place, np.float64))


def usual_pose(board_mm: Pixels, places_px: Pixels, size_px: tuple[int, int]) -> BoardPose | None:
    """Near enough for advice, before the camera is known."""
    width, height = size_px
    focal = USUAL_FOCAL * width
    matrix = np.array([(focal, 0, (width - 1) / 2), (0, focal, (height - 1) / 2), (0, 0, 1)])
    return find_pose(board_mm, places_px, matrix, np.zeros(5))
