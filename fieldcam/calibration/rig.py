"""A raw stereo camera: two lenses, and how their images become rectified ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcam.calibration.reading.documents import MILLIMETRES_PER_UNIT, Array, CalibrationDocument
from fieldcam.values import Calibration

BASELINE_RANGE_MM = (10.0, 1000.0)
"""Outside it the file's unit of length is surely not what it is taken for."""
LONGEST_UNSAID_MM = 100.0
"""Of a hand-held head, where OpenCV's T comes without a unit: 0.6 may be metres or squares."""

FEW_SQUARES = 10.0
"""A baseline is a few squares of a board long, and more than so many mm."""

FOCAL_TOLERANCE = 1e-4
"""Relative; rectified focal lengths that differ by more are different ones."""

DISTORTION_LENGTHS = (0, 4, 5, 8, 12, 14)
"""How many coefficients the pinhole distortion models have."""


@dataclass(frozen=True, slots=True, eq=False)
class EyeLens:
    """One lens of a raw stereo camera."""

    camera_matrix: Array
    """(3, 3), px."""
    distortion: Array
    """(N,) in OpenCV's order."""
    rotation: Array
    """(3, 3), from this eye's frame to the rectified one."""
    projection: Array
    """(3, 3), px: the rectified camera; the same for both eyes."""


@dataclass(frozen=True, slots=True, eq=False)
class StereoRig:
    """Both eyes of a raw stereo camera and the rectified camera they make."""

    left: EyeLens
    right: EyeLens
    rectified: Calibration

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the raw images, and of the rectified ones."""
        return self.rectified.size_px


def projection_focal_px(document: CalibrationDocument, projection: Array, name: str) -> float:
    """The one focal length of a rectified camera's projection matrix (3, 4)."""
    focal, focal_y = float(projection[0, 0]), float(projection[1, 1])
    if focal <= 0 or focal_y <= 0:
        raise document.refuse(f"has a focal length of {min(focal, focal_y):g} px in {name}.")
    if abs(focal - focal_y) > FOCAL_TOLERANCE * focal:
        raise document.refuse(
            f"has two focal lengths in {name}: {focal:g} and {focal_y:g} px.",
            "A rectified camera has one.",
        )
    if abs(projection[0, 1]) > FOCAL_TOLERANCE * focal or projection[2, 2] == 0:
        raise document.refuse(f"has an entry {name} that describes no rectified camera.")
    return focal


def projection_baseline_mm(document: CalibrationDocument, projection: Array, name: str) -> float:
    """Baseline in mm from the right eye's projection matrix (3, 4), whose P[0, 3] is -f b."""
    if projection[0, 3] == 0:
        if projection[1, 3] != 0:
            raise document.refuse("describes a pair with one eye above the other.")
        raise document.refuse(
            f"has no baseline: the fourth number of its {name} is 0.",
            "This is the left camera's file; give the right camera's.",
        )
    return check_baseline(document, float(-projection[0, 3] / projection[0, 0]))


def check_translation(document: CalibrationDocument, translation: Array) -> None:
    """T, (3,), carries a point from the left eye's frame to the right's: its x is -b."""
    if abs(translation[0]) < abs(translation[1]):
        raise document.refuse("describes a pair with one eye above the other.")
    length = float(np.copysign(np.linalg.norm(translation), -translation[0]))
    check_baseline(document, length, None if document.text("units") else LONGEST_UNSAID_MM)


def check_baseline(
    document: CalibrationDocument, length: float, longest_mm: float | None = None
) -> float:
    """The distance between the eyes in mm, from what the file gives in its own unit.

    Refuses one that no such camera has, or that is more than `longest_mm`.
    """
    baseline_mm = length * document.millimetres_per_unit()
    if baseline_mm < 0:
        raise document.refuse(
            f"puts the right eye {-baseline_mm:g} mm to the left of the left one.",
            "Are the two eyes swapped?",
        )
    shortest, longest = BASELINE_RANGE_MM[0], longest_mm or BASELINE_RANGE_MM[1]
    if shortest <= baseline_mm <= longest:
        return baseline_mm
    raise document.refuse(
        f"gives a distance of {baseline_mm:g} mm between the eyes,"
        f" outside {shortest:g} to {longest:g} mm.",
        _which_unit(length),
    )


def _which_unit(length: float) -> str:
    """What the number could mean, since the file's word for it cannot be right."""
    shortest, longest = BASELINE_RANGE_MM
    fitting = [
        unit
        for unit in ("m", "cm", "mm")
        if shortest <= length * MILLIMETRES_PER_UNIT[unit] <= longest
    ]
    squares = (
        f"If {length:.4g} counts squares of the calibration board, say how long one is, as in"
        " `units: 25 mm`."
    )
    if not fitting:
        return f"It is no such distance in m, cm or mm. {squares}"
    lines = " or ".join(f"`units: {unit}`" for unit in fitting)
    named = f"If its lengths are in {' or '.join(fitting)}, the file needs the line {lines}."
    return f"{squares} {named}" if length < FEW_SQUARES else f"{named} {squares}"


def checked_eye(document: CalibrationDocument, eye: EyeLens, name: str) -> EyeLens:
    """The same eye, its lens checked."""
    matrix = eye.camera_matrix
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        raise document.refuse(f"has a focal length that is not positive in {name}.")
    if not np.allclose(matrix[2], (0.0, 0.0, 1.0)):
        raise document.refuse(f"has an entry {name} that is no camera matrix.")
    if eye.distortion.size not in DISTORTION_LENGTHS:
        raise document.refuse(
            f"has {eye.distortion.size} distortion coefficients; known are 4, 5, 8, 12 or 14."
        )
    return eye


def assemble_rig(
    document: CalibrationDocument,
    left: EyeLens,
    right: EyeLens,
    projections: tuple[Array, Array],
    size_px: tuple[int, int],
) -> StereoRig:
    """Joins two eyes whose rectified projections (3, 4) are known.

    Both get the left one's principal point, whatever the file says: where the
    file keeps two of them, the right image is moved, so that disparity is zero
    at infinity.
    """
    left_projection, right_projection = projections
    focal_px = projection_focal_px(document, left_projection, "the left projection")
    right_focal_px = projection_focal_px(document, right_projection, "the right projection")
    if abs(focal_px - right_focal_px) > FOCAL_TOLERANCE * focal_px:
        raise document.refuse("gives the two rectified eyes different focal lengths.")
    if left_projection[0, 3] != 0 and right_projection[0, 3] == 0:
        raise document.refuse("has the eyes swapped: the baseline is with the left one.")
    shared = left_projection[:, :3].copy()
    return StereoRig(
        left=replace(left, projection=shared),
        right=replace(right, projection=shared),
        rectified=Calibration(
            width_px=size_px[0],
            height_px=size_px[1],
            focal_px=focal_px,
            cx_px=float(shared[0, 2]),
            cy_px=float(shared[1, 2]),
            baseline_mm=projection_baseline_mm(document, right_projection, "right projection"),
        ),
    )
