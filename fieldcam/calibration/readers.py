"""Reads every calibration file that fieldcam accepts.

A ROS CameraInfo dump of the right eye describes a pair that is already
rectified (`load_rectified`); a folder with both eyes' dumps, or what OpenCV's
stereo calibration sample writes, describes a raw pair (`load_stereo_rig`);
`load_camera` takes either.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fieldcam.calibration.documents import Array, Document, read_document
from fieldcam.calibration.rig import (
    Eye,
    StereoRig,
    assemble_rig,
    check_baseline,
    checked_eye,
    projection_baseline_mm,
    projection_focal_px,
)
from fieldcam.errors import CalibrationInvalid
from fieldcam.values import Calibration

PROJECTION = ("P", "projection_matrix")
CAMERA_MATRIX = ("K", "camera_matrix")
DISTORTION = ("D", "distortion_coefficients")
RECTIFICATION = ("R", "rectification_matrix")

SUFFIXES = (".yml", ".yaml")


def load_rectified(path: Path) -> Calibration:
    """The rectified camera that the right eye's CameraInfo dump describes.

    Its D and K are history and not applied.
    """
    document = read_document(path)
    if not document.has(*PROJECTION) and _is_opencv_rig(document):
        raise document.refuse(
            "describes a camera whose images are still raw.", "Add --rectify to rectify them."
        )
    projection = document.matrix((3, 4), *PROJECTION)
    focal_px = projection_focal_px(document, projection, "P")
    width_px, height_px = _known_size(document, None)
    return Calibration(
        width_px=width_px,
        height_px=height_px,
        focal_px=focal_px,
        cx_px=float(projection[0, 2]),
        cy_px=float(projection[1, 2]),
        baseline_mm=projection_baseline_mm(document, projection, "P"),
    )


def load_stereo_rig(path: Path, size_px: tuple[int, int] | None = None) -> StereoRig:
    """The raw stereo camera in a folder or file.

    `size_px` (width, height) stands in where the file does not give the image
    size, as those of OpenCV's sample don't.
    """
    if not path.is_dir():
        return _opencv_rig(read_document(path), size_px)
    intrinsics, extrinsics = _member(path, "intrinsics"), _member(path, "extrinsics")
    if intrinsics and extrinsics:
        lenses, pose = read_document(intrinsics), read_document(extrinsics)
        return _opencv_rig(Document(pose.path, {**lenses.entries, **pose.entries}), size_px)
    left, right = _member(path, "left"), _member(path, "right")
    if left and right:
        return _camera_info_rig(read_document(left), read_document(right), size_px)
    raise CalibrationInvalid(
        f"The folder {path} holds no stereo calibration.",
        "It needs left.yml and right.yml, or intrinsics.yml and extrinsics.yml.",
    )


def load_camera(path: Path, size_px: tuple[int, int] | None = None) -> Calibration | StereoRig:
    """Whichever camera a file or folder describes: a rectified one, or both raw eyes."""
    if path.is_dir() or _is_opencv_rig(document := read_document(path)):
        return load_stereo_rig(path, size_px)
    return load_rectified(document.path)


def _member(folder: Path, stem: str) -> Path | None:
    candidates = (folder / f"{stem}{suffix}" for suffix in SUFFIXES)
    return next((path for path in candidates if path.is_file()), None)


def _known_size(document: Document, fallback: tuple[int, int] | None) -> tuple[int, int]:
    size = document.size_px() or fallback
    if size is None:
        raise document.refuse(
            "does not give the image size.", "Add image_width and image_height to it."
        )
    return size


def _camera_info_rig(left: Document, right: Document, size_px: tuple[int, int] | None) -> StereoRig:
    size = _known_size(left, size_px)
    if _known_size(right, size_px) != size:
        raise right.refuse(f"and {left.path.name} give different image sizes.")
    projections = left.matrix((3, 4), *PROJECTION), right.matrix((3, 4), *PROJECTION)
    return assemble_rig(right, _camera_info_eye(left), _camera_info_eye(right), projections, size)


def _camera_info_eye(document: Document) -> Eye:
    model = document.entries.get("distortion_model", "plumb_bob")
    if model not in ("plumb_bob", "rational_polynomial"):
        raise document.refuse(f"uses the distortion model {model!r}, which is not supported.")
    eye = Eye(
        camera_matrix=document.matrix((3, 3), *CAMERA_MATRIX),
        distortion=document.numbers(*DISTORTION),
        rotation=document.rotation(*RECTIFICATION),
        projection=np.eye(3),
    )
    return checked_eye(document, eye, "K")


def _is_opencv_rig(document: Document) -> bool:
    return document.has("M1", "cameraMatrix1") and document.has("M2", "cameraMatrix2")


def _opencv_rig(document: Document, size_px: tuple[int, int] | None) -> StereoRig:
    if not _is_opencv_rig(document):
        raise document.refuse(
            "does not describe both raw eyes.",
            "Give a file with M1, D1, M2, D2, R and T, or a folder with both eyes' files.",
        )
    size = _known_size(document, size_px)
    left, right = _opencv_eye(document, "1"), _opencv_eye(document, "2")
    translation = document.matrix((3,), "T")
    _check_translation(document, translation)
    if not document.has("P1") or not document.has("P2"):
        left, right, projections = _rectify(document, left, right, translation, size)
        return assemble_rig(document, left, right, projections, size)
    left = replace(left, rotation=document.rotation("R1"))
    right = replace(right, rotation=document.rotation("R2"))
    projections = document.matrix((3, 4), "P1"), document.matrix((3, 4), "P2")
    return assemble_rig(document, left, right, projections, size)


def _opencv_eye(document: Document, number: str) -> Eye:
    matrix_name = f"M{number}"
    eye = Eye(
        camera_matrix=document.matrix((3, 3), matrix_name, f"cameraMatrix{number}"),
        distortion=document.numbers(f"D{number}", f"distCoeffs{number}"),
        rotation=np.eye(3),
        projection=np.eye(3),
    )
    return checked_eye(document, eye, matrix_name)


def _check_translation(document: Document, translation: Array) -> None:
    """T carries a point from the left eye's frame to the right's: its x is -b."""
    if abs(translation[0]) < abs(translation[1]):
        raise document.refuse("describes a pair with one eye above the other.")
    unit_mm = document.millimetres_per_unit()
    length_mm = float(np.linalg.norm(translation)) * unit_mm
    check_baseline(document.path, -float(np.copysign(length_mm, translation[0])), unit_mm)


def _rectify(
    document: Document, left: Eye, right: Eye, translation: Array, size_px: tuple[int, int]
) -> tuple[Eye, Eye, tuple[Array, Array]]:
    """Works out the rectified camera where the file leaves it to the reader."""
    import cv2  # here, so that reading a rectified camera's file does not load it

    try:
        left_rotation, right_rotation, left_projection, right_projection, *_ = cv2.stereoRectify(
            left.camera_matrix,
            left.distortion,
            right.camera_matrix,
            right.distortion,
            size_px,
            document.rotation("R"),
            translation.reshape(3, 1),
            alpha=0,
        )
    except cv2.error as error:
        raise document.refuse("describes a pair that cannot be rectified.") from error
    projections = np.asarray(left_projection, np.float64), np.asarray(right_projection, np.float64)
    if not all(np.isfinite(projection).all() for projection in projections):
        raise document.refuse("describes a pair that cannot be rectified.")
    return (
        replace(left, rotation=np.asarray(left_rotation, np.float64)),
        replace(right, rotation=np.asarray(right_rotation, np.float64)),
        projections,
    )
