"""Names the family of a tag that is no tag36h11, for a picture in which none was read."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from fieldcam.values import ImageU8
from fieldcam.vision.tags import LOWEST_DECISION_MARGIN, SMALLEST_SIDE_PX, SharedDetector

APRILTAGS = ("tag25h9", "tagStandard41h12", "tagCircle21h7")
"""On 50 photographs of apples none was seen; tag16h5 is left out, since leaves make it."""
ARUCO = {
    "ArUco original": cv2.aruco.DICT_ARUCO_ORIGINAL,
    "ArUco 4x4": cv2.aruco.DICT_4X4_50,
    "ArUco 5x5": cv2.aruco.DICT_5X5_1000,
    "ArUco 6x6": cv2.aruco.DICT_6X6_1000,
    "ArUco 7x7": cv2.aruco.DICT_7X7_1000,
    "tag36h10": cv2.aruco.DICT_APRILTAG_36h10,
    "ArUco MIP 36h12": cv2.aruco.DICT_ARUCO_MIP_36h12,
}
SHRUNK = 0.5
"""For ArUco: a card of the working range has 40 px then, which is plenty, in a quarter of the
time."""
LEAST_SIDE_PX = 25
"""Of the shrunk picture; smaller ones are mostly none."""


def other_family(image: ImageU8) -> str:
    """Such as `tag25h9` or `ArUco 6x6`; empty where no tag of these is seen.

    `image` is RGB or one channel.
    """
    if min(image.shape[:2]) < SMALLEST_SIDE_PX:
        return ""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    whole = np.ascontiguousarray(grey, np.uint8)
    clear = [
        detection.tag_family.decode()
        for detection in _apriltags().detect(whole)
        if detection.decision_margin >= LOWEST_DECISION_MARGIN
    ]
    return clear[0] if clear else _aruco_family(whole)


def _aruco_family(grey: ImageU8) -> str:
    small = cv2.resize(grey, None, fx=SHRUNK, fy=SHRUNK, interpolation=cv2.INTER_AREA)
    corners, _ids, _rejected, families = _aruco().detectMarkersMultiDict(small)
    for square, family in zip(corners, np.ravel(families) if len(corners) else (), strict=True):
        sides_px = np.linalg.norm(square[0] - np.roll(square[0], 1, axis=0), axis=1)
        if sides_px.min() >= LEAST_SIDE_PX:
            return list(ARUCO)[int(family)]
    return ""


@lru_cache(maxsize=1)
def _apriltags() -> SharedDetector:
    return SharedDetector(" ".join(APRILTAGS))


@lru_cache(maxsize=1)
def _aruco() -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.errorCorrectionRate = 0.0
    dictionaries = [cv2.aruco.getPredefinedDictionary(each) for each in ARUCO.values()]
    return cv2.aruco.ArucoDetector(dictionaries, parameters)
