"""A rectified camera as the file that describes it beside captures; loads no library for it."""

from __future__ import annotations

import json

from fieldcam.values import Calibration


def rectified_file(camera: Calibration) -> bytes:
    """A ROS CameraInfo of the right eye, whose P gives focal length, centre and -f times b.

    As JSON, which is YAML too; numbers come back as they were, but for the last digit of b.
    """
    focal, cx, cy = (float(each) for each in (camera.focal_px, camera.cx_px, camera.cy_px))
    shift = -focal * float(camera.baseline_mm) / 1000
    document = {
        "height": int(camera.height_px),
        "width": int(camera.width_px),
        "distortion_model": "plumb_bob",
        "D": [0.0] * 5,
        "K": [focal, 0.0, cx, 0.0, focal, cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [focal, 0.0, cx, shift, 0.0, focal, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
    return json.dumps(document).encode() + b"\n"
