"""Finds AprilTags (tag36h11) and their poses.

The library's own edge refinement stays off: on photographs it lost three of 47
tags. Corners of tags as large as those in the working range are refined here.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt
from fieldcam.vision.tags.corners import refine_corners
from pupil_apriltags import Detection, Detector

from fieldcam.values import TAG_SIZE_MM, Calibration, ImageU8, TagPose

FAMILY = "tag36h11"
HALF_PIXEL = 0.5
"""The library puts the first pixel's centre at (0.5, 0.5), fieldcam at (0, 0)."""

LOWEST_DECISION_MARGIN = 4.0
"""Grey levels; real tags stay above it down to a contrast of 10 grey levels."""

SMALLEST_SIDE_PX = 10
"""A tag has ten cells to a side; the library's C code crashes on images of one or two pixels."""

Corners = npt.NDArray[np.float64]


class _SafeDetector(Detector):
    """The library's detector, freed in the order that its C code needs.

    The library frees the tag family first, which the detector still reads while
    it is freed itself.
    """

    def __del__(self) -> None:
        if self.tag_detector_ptr is None:
            return
        self.libc.apriltag_detector_destroy.restype = None
        self.libc.apriltag_detector_destroy(self.tag_detector_ptr)
        self.tag_detector_ptr = None
        while self.tag_families:
            name, family = self.tag_families.popitem()
            destroy = getattr(self.libc, f"{name}_destroy")
            destroy.restype = None
            destroy(family)


class SharedDetector:
    """One detector for all threads; its C code works on one image at a time."""

    def __init__(self, families: str) -> None:
        """Names of tag families, with spaces between."""
        self._lock = threading.Lock()
        # With more threads of its own the library now and then crashes: its worker
        # pool starts before its mutexes are set up (AprilRobotics/apriltag 339).
        self._detector = _SafeDetector(
            families=families, nthreads=1, quad_decimate=1.0, refine_edges=0
        )

    def detect(self, grey: ImageU8) -> list[Detection]:
        with self._lock:
            return self._detector.detect(grey)


@lru_cache(maxsize=1)
def _shared_detector() -> SharedDetector:
    return SharedDetector(FAMILY)


def detect_tags(
    image: ImageU8,
    calibration: Calibration | None = None,
    tag_size_mm: float = TAG_SIZE_MM,
) -> tuple[TagPose, ...]:
    """All tags of an image, RGB or one channel, duplicates included.

    Without a calibration the tags have no pose.
    """
    if min(image.shape[:2]) < SMALLEST_SIDE_PX:
        return ()
    colourless = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    grey = np.ascontiguousarray(colourless, np.uint8)
    detections = _shared_detector().detect(grey)
    return tuple(
        _tag_pose(detection, grey, calibration, tag_size_mm)
        for detection in detections
        if detection.decision_margin >= LOWEST_DECISION_MARGIN
    )


def choose_tag(
    tags: Iterable[TagPose], expected_id: int | None, size_px: tuple[int, int]
) -> TagPose | None:
    """The tag that counts: the expected one, else the one nearest the image centre.

    `size_px` is the image's width and height.
    """
    center = np.array([(side - 1) / 2 for side in size_px])

    def rank(tag: TagPose) -> tuple[bool, float]:
        distance_px = np.linalg.norm(np.array(tag.center_px) - center)
        return tag.id != expected_id, float(distance_px)

    return min(tags, key=rank, default=None)


def _tag_pose(
    detection: Detection, grey: ImageU8, calibration: Calibration | None, tag_size_mm: float
) -> TagPose:
    corners = refine_corners(grey, detection.corners - HALF_PIXEL)
    center = _diagonals_crossing(corners)
    pose = None if calibration is None else _solve_pose(corners, calibration, tag_size_mm)
    translation, rotation = pose or (None, None)
    return TagPose(
        id=int(detection.tag_id),
        center_px=(float(center[0]), float(center[1])),
        corners_px=tuple((float(x), float(y)) for x, y in corners),
        translation_mm=translation,
        rotation=rotation,
        decision_margin=float(detection.decision_margin),
    )


def _diagonals_crossing(corners: Corners) -> Corners:
    """The tag's centre, also in perspective: (2,)."""
    first, second = corners[2] - corners[0], corners[3] - corners[1]
    share = np.linalg.solve(np.column_stack((first, -second)), corners[1] - corners[0])[0]
    return np.asarray(corners[0] + share * first)


Pose = tuple[tuple[float, float, float], tuple[tuple[float, float, float], ...]]


def _solve_pose(corners: Corners, calibration: Calibration, tag_size_mm: float) -> Pose | None:
    """Translation (mm) and rotation of the better of the two poses of a square.

    The tag's frame is x right, y down, z away from the viewer: that of the
    camera for a tag that is looked at head-on and upright.
    """
    half = tag_size_mm / 2
    square_mm = np.array([(-half, half, 0), (half, half, 0), (half, -half, 0), (-half, -half, 0)])
    focal = calibration.focal_px
    camera_matrix = np.array(
        [(focal, 0, calibration.cx_px), (0, focal, calibration.cy_px), (0, 0, 1)]
    )
    count, rotations, translations, _errors = cv2.solvePnPGeneric(
        square_mm, corners, camera_matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
    )
    if not count:
        return None
    x, y, z = (float(value) for value in np.ravel(translations[0]))
    rotation = np.asarray(cv2.Rodrigues(rotations[0])[0], np.float64)
    if not (np.isfinite([x, y, z]).all() and np.isfinite(rotation).all() and z > 0):
        return None
    rows = tuple((float(row[0]), float(row[1]), float(row[2])) for row in rotation)
    return (x, y, z), rows
