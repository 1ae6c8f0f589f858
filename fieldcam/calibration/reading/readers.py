"""The camera that a calibration describes: a rectified one, or both raw eyes.

A CameraInfo of the right eye describes a pair that is already rectified
(`load_rectified`); both eyes' CameraInfo, or what OpenCV's programs and Kalibr write,
describe a raw pair (`load_stereo_rig`); `load_camera` takes either.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from fieldcam.calibration.reading.camera_info import (
    PROJECTION,
    Window,
    check_picture,
    projection,
    raw_eye,
    window,
)
from fieldcam.calibration.reading.documents import Array, CalibrationDocument
from fieldcam.calibration.reading.lens_models import check_lens
from fieldcam.calibration.reading.sources import (
    EXTRINSICS,
    INTRINSICS,
    LEFT,
    RIGHT,
    Documents,
    open_documents,
    read_document,
)
from fieldcam.calibration.rig import (
    FOCAL_TOLERANCE,
    EyeLens,
    StereoRig,
    assemble_rig,
    check_translation,
    checked_eye,
    projection_baseline_mm,
    projection_focal_px,
)
from fieldcam.errors import CalibrationInvalid
from fieldcam.values import Calibration

MATRICES = ("M{}", "K{}", "cameraMatrix{}", "CM{}")
COEFFICIENTS = ("D{}", "distCoeffs{}", "dist{}")
"""What programs call those of eye 1 and eye 2."""
CENTRE_TOLERANCE_PX = 0.1
"""Of disparity: 0.04 % of a size."""


def load_rectified(path: Path, size_px: tuple[int, int] | None = None) -> Calibration:
    """The rectified camera that the right eye's CameraInfo describes.

    Its D and K are history and not applied. `size_px` (width, height) is that of the pictures,
    where they are known.
    """
    if path.is_dir():
        raise CalibrationInvalid(
            f"{path} is a folder, not a calibration file.",
            "Give the right eye's file, or add --rectify where the images are still raw.",
        )
    documents = open_documents(path)
    document = _rectified(path, documents)
    if not document.has(*PROJECTION):
        raise _without_projection(document)
    seen = window(document, _known_size(document, None))
    check_picture(document, seen, size_px)
    matrix = projection(document, seen)
    left = documents.get(LEFT) or _left_beside(path)
    if left is not None and left.has(*PROJECTION):
        _check_one_camera(document, matrix, projection(left, seen))
    width_px, height_px = seen.size_px
    return Calibration(
        width_px=width_px,
        height_px=height_px,
        focal_px=projection_focal_px(document, matrix, "P"),
        cx_px=float(matrix[0, 2]),
        cy_px=float(matrix[1, 2]),
        baseline_mm=projection_baseline_mm(document, matrix, "P"),
    )


def load_stereo_rig(path: Path, size_px: tuple[int, int] | None = None) -> StereoRig:
    """The raw stereo camera in a folder, an archive or a file.

    `size_px` (width, height) stands in where the file does not give the image
    size, as those of OpenCV's programs don't.
    """
    documents = open_documents(path)
    if INTRINSICS in documents and EXTRINSICS in documents:
        lenses, pose = documents[INTRINSICS], documents[EXTRINSICS]
        return _opencv_rig(
            CalibrationDocument(pose.path, {**lenses.entries, **pose.entries}), size_px
        )
    if LEFT in documents and RIGHT in documents:
        return _camera_info_rig(documents[LEFT], documents[RIGHT], size_px)
    whole = next((each for each in documents.values() if _is_opencv_rig(each)), None)
    if whole is None and len(documents) == 1 and not path.is_dir():
        (whole,) = documents.values()
    if whole is None:
        raise CalibrationInvalid(
            f"{path} holds no stereo calibration.",
            "It needs left.yml and right.yml, or intrinsics.yml and extrinsics.yml.",
        )
    return _opencv_rig(whole, size_px)


def load_camera(path: Path, size_px: tuple[int, int] | None = None) -> Calibration | StereoRig:
    """Whichever camera a file or folder describes: a rectified one, or both raw eyes."""
    documents = open_documents(path)
    one_eye = len(documents) == 1 and not any(map(_is_opencv_rig, documents.values()))
    load = load_rectified if one_eye and not path.is_dir() else load_stereo_rig
    return load(path, size_px)


def _rectified(path: Path, documents: Documents) -> CalibrationDocument:
    """The right eye's, where there are several."""
    if RIGHT in documents:
        return documents[RIGHT]
    found = [each for each in documents.values() if each.has(*PROJECTION)]
    if found or documents:
        return (found or list(documents.values()))[0]
    raise CalibrationInvalid(
        f"{path} holds no calibration.", "It needs right.yaml, or ost.txt of the right eye."
    )


def _left_beside(path: Path) -> CalibrationDocument | None:
    """The other eye's file, where the name of the right one's says what it is called."""
    left = path.with_name(path.name.replace(RIGHT, LEFT))
    if left != path and left.is_file():
        with suppress(CalibrationInvalid):  # nothing is read from it but what it may contradict
            return read_document(left)
    return None


def _check_one_camera(document: CalibrationDocument, right: Array, left: Array) -> None:
    """Both (3, 4): disparity is counted from one centre, and sizes from one focal length."""
    if abs(left[0, 0] - right[0, 0]) > FOCAL_TOLERANCE * abs(right[0, 0]):
        raise document.refuse(
            f"and the left eye's have two focal lengths: {right[0, 0]:g} and {left[0, 0]:g} px.",
            _ONE_CAMERA,
        )
    if np.abs(left[:2, 2] - right[:2, 2]).max() > CENTRE_TOLERANCE_PX:
        right_px, left_px = (f"({each[0, 2]:g}, {each[1, 2]:g})" for each in (right, left))
        raise document.refuse(
            f"has its centre at {right_px} px, and the left eye's at {left_px}: distances would be"
            " wrong.",
            _ONE_CAMERA,
        )


_ONE_CAMERA = (
    "Add --rectify and give raw images, or rectify both eyes to one centre and one focal length,"
    " as OpenCV does with CALIB_ZERO_DISPARITY."
)


def _without_projection(document: CalibrationDocument) -> CalibrationInvalid:
    if _is_opencv_rig(document):
        return document.refuse(
            "describes a camera whose images are still raw.", "Add --rectify to rectify them."
        )
    if eyes := _raw_eyes(document):
        return document.refuse(f"describes two raw eyes ({eyes}), by names not known.", _RENAME)
    if _lens_alone(document):
        return document.refuse(
            "describes one lens and not where the other eye is.",
            "Calibrate both eyes together: `fieldcam calibrate` does it from pictures of a board.",
        )
    return document.refuse("has no entry P or projection_matrix.")


_RENAME = "Call them M1, D1, M2, D2 (1 is the left eye), R and T, and add --rectify."


def _raw_eyes(document: CalibrationDocument) -> str:
    """The names of several camera matrices, whatever a program calls them; else empty."""
    names = [name for name in document.entries if _is_camera_matrix(document, name)]
    return " and ".join(names) if len(names) > 1 else ""


def _is_camera_matrix(document: CalibrationDocument, name: str) -> bool:
    try:
        values = document.numbers(name)
    except CalibrationInvalid:
        return False
    return values.size == 9 and values[0] > 1 < values[4] and values[6:].tolist() == [0, 0, 1]


def _lens_alone(document: CalibrationDocument) -> bool:
    return document.has("camera_matrix", "K", "k", "cameraMatrix", "intrinsics", "mtx")


def _known_size(document: CalibrationDocument, fallback: tuple[int, int] | None) -> tuple[int, int]:
    size = document.size_px() or fallback
    if size is None:
        raise document.refuse(
            "does not give the image size.", "Add image_width and image_height to it."
        )
    return size


def _camera_info_rig(
    left: CalibrationDocument, right: CalibrationDocument, size_px: tuple[int, int] | None
) -> StereoRig:
    windows = [window(eye, _known_size(eye, size_px)) for eye in (left, right)]
    check_picture(right, windows[1], size_px)
    sizes_px = {seen.size_px for seen in windows}
    if len(sizes_px) > 1:
        raise right.refuse(f"and {left.path.name} give different image sizes.")
    (left_eye, of_left), (right_eye, of_right) = map(_eye_of, (left, right), windows)
    return assemble_rig(right, left_eye, right_eye, (of_left, of_right), sizes_px.pop())


def _eye_of(document: CalibrationDocument, seen: Window) -> tuple[EyeLens, Array]:
    return raw_eye(document, seen), projection(document, seen)


def _is_opencv_rig(document: CalibrationDocument) -> bool:
    return all(document.has(*_numbered(MATRICES, eye)) for eye in "12")


def _numbered(names: tuple[str, ...], eye: str) -> tuple[str, ...]:
    return tuple(name.format(eye) for name in names)


def _opencv_rig(document: CalibrationDocument, size_px: tuple[int, int] | None) -> StereoRig:
    if not _is_opencv_rig(document):
        if document.has(*PROJECTION):
            raise document.refuse(
                "describes one eye, and --rectify needs both.",
                "Give a folder with left.yml and right.yml; images that are rectified already"
                " go without --rectify.",
            )
        if eyes := _raw_eyes(document):
            raise document.refuse(f"describes two raw eyes ({eyes}), by names not known.", _RENAME)
        raise document.refuse(
            "does not describe both raw eyes.",
            "Give a file with M1, D1, M2, D2, R and T, or a folder with both eyes' files.",
        )
    size = _known_size(document, size_px)
    left, right = _opencv_eye(document, "1"), _opencv_eye(document, "2")
    translation = document.matrix((3,), "T")
    check_translation(document, translation)
    if not document.has("P1") or not document.has("P2"):
        left, right, projections = _rectify(document, left, right, translation, size)
        return assemble_rig(document, left, right, projections, size)
    left = replace(left, rotation=document.rotation("R1"))
    right = replace(right, rotation=document.rotation("R2"))
    projections = document.matrix((3, 4), "P1"), document.matrix((3, 4), "P2")
    return assemble_rig(document, left, right, projections, size)


def _opencv_eye(document: CalibrationDocument, number: str) -> EyeLens:
    names = _numbered(MATRICES, number)
    distortion = document.numbers(*_numbered(COEFFICIENTS, number))
    check_lens(document, distortion)
    eye = EyeLens(
        camera_matrix=document.matrix((3, 3), *names),
        distortion=distortion,
        rotation=np.eye(3),
        projection=np.eye(3),
    )
    return checked_eye(document, eye, names[0])


def _rectify(
    document: CalibrationDocument,
    left: EyeLens,
    right: EyeLens,
    translation: Array,
    size_px: tuple[int, int],
) -> tuple[EyeLens, EyeLens, tuple[Array, Array]]:
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
