"""The rectified camera that two lenses make, and how well the rows of the eyes agree in it."""

from __future__ import annotations

import cv2
import numpy as np

from fieldcam.calibration.boards import BoardView, Pixels
from fieldcam.calibration.reading.documents import Array
from fieldcam.calibration.rig import BASELINE_RANGE_MM, EyeLens, StereoRig
from fieldcam.calibration.solving import Lens, RawStereo
from fieldcam.errors import CalibrationInvalid
from fieldcam.values import Calibration


def rectified_rig(camera: RawStereo) -> StereoRig:
    """Both eyes turned onto one row; no pixel of theirs sees beyond its picture.

    Raises CalibrationInvalid where the eyes do not stand as those of a stereo head.
    """
    _check_baseline(camera)
    left_turn, right_turn, projection, *_ = cv2.stereoRectify(
        camera.left.camera_matrix,
        camera.left.distortion,
        camera.right.camera_matrix,
        camera.right.distortion,
        camera.size_px,
        camera.rotation,
        camera.translation_mm[:, None],
        flags=cv2.CALIB_ZERO_DISPARITY,
        alpha=0,
    )
    shared = np.asarray(projection, np.float64)[:, :3]
    return StereoRig(
        _eye(camera.left, left_turn, shared),
        _eye(camera.right, right_turn, shared),
        Calibration(
            width_px=camera.size_px[0],
            height_px=camera.size_px[1],
            focal_px=float(shared[0, 0]),
            cx_px=float(shared[0, 2]),
            cy_px=float(shared[1, 2]),
            baseline_mm=camera.baseline_mm,
        ),
    )


def rows_off_px(rig: StereoRig, view: BoardView) -> Array:
    """(N,): how much lower the left eye sees each corner than the right one, rectified."""
    left, right = _placed(rig.left, view.left_px), _placed(rig.right, view.right_px)
    return np.asarray((left - right)[:, 1], np.float64)


def _check_baseline(camera: RawStereo) -> None:
    """The right eye sees from the right: its frame has the left eye at -baseline."""
    x_mm, y_mm, z_mm = camera.translation_mm
    if abs(x_mm) < max(abs(y_mm), abs(z_mm)):
        raise CalibrationInvalid(
            "The eyes do not stand side by side in these pictures.",
            "Are left and right of one head, and neither of them turned?",
        )
    if x_mm > 0:
        raise CalibrationInvalid(
            "The eyes are swapped: what is called left was taken by the right eye.",
            "Check the cables or the file names.",
        )
    shortest, longest = BASELINE_RANGE_MM
    if not shortest <= camera.baseline_mm <= longest:
        raise CalibrationInvalid(
            f"The eyes come out {camera.baseline_mm:.1f} mm apart,"
            f" outside {shortest:g} to {longest:g} mm.",
            "Measure a square of the board and give its side with --square-mm.",
        )


def _eye(lens: Lens, turn: object, projection: Array) -> EyeLens:
    return EyeLens(lens.camera_matrix, lens.distortion, np.asarray(turn, np.float64), projection)


def _placed(eye: EyeLens, places_px: Pixels) -> Array:
    """(N, 2): where the rectified eye has these pixels."""
    found = cv2.undistortPoints(
        places_px, eye.camera_matrix, eye.distortion, R=eye.rotation, P=eye.projection
    )
    return np.asarray(found, np.float64).reshape(-1, 2)
