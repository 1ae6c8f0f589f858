"""A solved camera as the files that fieldcam, ROS and OpenCV read.

`left.yml` and `right.yml` are ROS CameraInfo, `intrinsics.yml` and `extrinsics.yml`
what OpenCV's stereo sample writes, and `calibration.yml` holds the latter two in one,
as it lies beside captures. Lengths are in metres, as in all of these by custom.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

import cv2
import numpy as np
import yaml

from fieldcam.calibration.reading.documents import (
    CALIBRATION_NAMES,
    MILLIMETRES_PER_UNIT,
    SERIALS,
    Array,
)
from fieldcam.calibration.rig import EyeLens, StereoRig
from fieldcam.calibration.solving import RawStereo

_METRE = MILLIMETRES_PER_UNIT["m"]


def calibration_files(
    camera: RawStereo, rig: StereoRig, serials: tuple[str, str] | None = None
) -> dict[str, bytes]:
    """Content by file name; `rig` is that camera rectified.

    `serials` are those of its eyes, left before right, where they are known.
    """
    baseline_m = rig.rectified.baseline_mm / _METRE
    intrinsics = {
        "M1": camera.left.camera_matrix,
        "D1": camera.left.distortion[None],
        "M2": camera.right.camera_matrix,
        "D2": camera.right.distortion[None],
    }
    extrinsics = {
        "R": camera.rotation,
        "T": camera.translation_mm[:, None] / _METRE,
        "R1": rig.left.rotation,
        "R2": rig.right.rotation,
        "P1": _projection(rig.left, 0.0),
        "P2": _projection(rig.right, baseline_m),
    }
    return {
        "left.yml": _camera_info(rig, rig.left, 0.0),
        "right.yml": _camera_info(rig, rig.right, baseline_m),
        "intrinsics.yml": _opencv(rig.size_px, intrinsics),
        "extrinsics.yml": _opencv(rig.size_px, extrinsics),
        CALIBRATION_NAMES[0]: _opencv(rig.size_px, {**intrinsics, **extrinsics}, serials),
    }


def _projection(eye: EyeLens, baseline_m: float) -> Array:
    """(3, 4): of an eye that stands so far to the right."""
    offset = np.array([-eye.projection[0, 0] * baseline_m, 0.0, 0.0])
    return np.column_stack((eye.projection, offset))


def _camera_info(rig: StereoRig, eye: EyeLens, baseline_m: float) -> bytes:
    """As `rostopic echo` prints it; matrices by rows."""
    width, height = rig.size_px
    entries = {
        "height": height,
        "width": width,
        "distortion_model": "plumb_bob",
        "D": eye.distortion.tolist(),
        "K": eye.camera_matrix.ravel().tolist(),
        "R": eye.rotation.ravel().tolist(),
        "P": _projection(eye, baseline_m).ravel().tolist(),
    }
    text: str = yaml.safe_dump(entries, sort_keys=False, default_flow_style=None, width=1000)
    return text.encode("ascii")


def _opencv(
    size_px: tuple[int, int],
    matrices: Mapping[str, Array],
    serials: tuple[str, str] | None = None,
) -> bytes:
    storage = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("image_width", size_px[0])
    storage.write("image_height", size_px[1])
    for name, matrix in matrices.items():
        storage.write(name, np.ascontiguousarray(matrix))
    # OpenCV escapes an apostrophe, which YAML does not know.
    named = "".join(f"{k}: {json.dumps(v)}\n" for k, v in zip(SERIALS, serials or (), strict=False))
    return (storage.releaseAndGetString() + named).encode("ascii")
