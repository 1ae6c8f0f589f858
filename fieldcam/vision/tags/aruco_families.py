"""Which of OpenCV's families of square markers a picture shows."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from fieldcam.values import ImageU8

FAMILIES = {
    "ArUco original": cv2.aruco.DICT_ARUCO_ORIGINAL,
    "ArUco 4x4": cv2.aruco.DICT_4X4_1000,
    "ArUco 5x5": cv2.aruco.DICT_5X5_1000,
    "ArUco 6x6": cv2.aruco.DICT_6X6_1000,
    "ArUco 7x7": cv2.aruco.DICT_7X7_1000,
    "tag16h5": cv2.aruco.DICT_APRILTAG_16h5,
    "tag25h9": cv2.aruco.DICT_APRILTAG_25h9,
    "tag36h10": cv2.aruco.DICT_APRILTAG_36h10,
    "tag36h11": cv2.aruco.DICT_APRILTAG_36h11,
    "ArUco MIP 36h12": cv2.aruco.DICT_ARUCO_MIP_36h12,
}


def marker_counts(grey: ImageU8, least_side_px: float) -> dict[str, int]:
    """How many markers of each family are seen, one channel (H, W); smaller ones do not count."""
    corners, _ids, _rejected, families = _detector().detectMarkersMultiDict(grey)
    counts = dict.fromkeys(FAMILIES, 0)
    for square, family in zip(corners, np.ravel(families) if len(corners) else (), strict=True):
        sides_px = np.linalg.norm(square[0] - np.roll(square[0], 1, axis=0), axis=1)
        counts[list(FAMILIES)[int(family)]] += bool(sides_px.min() >= least_side_px)
    return counts


@lru_cache(maxsize=1)
def _detector() -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.errorCorrectionRate = 0.0
    dictionaries = [cv2.aruco.getPredefinedDictionary(each) for each in FAMILIES.values()]
    return cv2.aruco.ArucoDetector(dictionaries, parameters)
