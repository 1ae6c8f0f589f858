"""ROS's CameraInfo: one eye of a camera, as its pictures are now.

K and P are of the whole sensor; a picture that the camera bins, or cuts out (`roi`), has
other ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcam.calibration.reading.documents import Array, CalibrationDocument
from fieldcam.calibration.reading.lens_models import check_lens
from fieldcam.calibration.rig import EyeLens, checked_eye

PROJECTION = ("P", "p", "projection_matrix")
CAMERA_MATRIX = ("K", "k", "camera_matrix")
DISTORTION = ("D", "d", "distortion_coefficients", "distCoeffs", "dist_coeffs")
RECTIFICATION = ("R", "r", "rectification_matrix")
MAX_BINNED = 16
NO_ENTRY = ("", "null", "none", "~")
"""What stands in the place of named entries that there are none of, in lower case."""


@dataclass(frozen=True, slots=True)
class Window:
    """What of the sensor a picture shows, and how coarsely."""

    x_px: int
    y_px: int
    width_px: int
    height_px: int
    """Of the sensor's pixels."""
    binning_x: int
    binning_y: int

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the pictures."""
        return self.width_px // self.binning_x, self.height_px // self.binning_y

    def applied(self, matrix: Array) -> Array:
        """A camera (3, 3) or projection matrix (3, 4) of the whole sensor as that of a picture."""
        moved, finer = np.eye(3), (0.5 * (1 / np.array([self.binning_x, self.binning_y]) - 1))
        moved[0] = 1 / self.binning_x, 0, finer[0] - self.x_px / self.binning_x
        moved[1] = 0, 1 / self.binning_y, finer[1] - self.y_px / self.binning_y
        return moved @ matrix


def window(document: CalibrationDocument, size_px: tuple[int, int]) -> Window:
    """Raises CalibrationInvalid where it lies beyond a sensor of this size, or is none."""
    binning = [max(_whole(document, name), 1) for name in ("binning_x", "binning_y")]
    if max(binning) > MAX_BINNED:
        raise document.refuse(f"bins {binning[0]} x {binning[1]} pixels into one.")
    x, y, width, height = 0, 0, *size_px
    if _is_given(document, "roi"):
        roi = document.part("roi")
        x, y = _whole(roi, "x_offset"), _whole(roi, "y_offset")
        width = _whole(roi, "width") or size_px[0] - x
        height = _whole(roi, "height") or size_px[1] - y
    if x + width > size_px[0] or y + height > size_px[1] or width <= 0 or height <= 0:
        raise document.refuse(
            f"cuts {width} x {height} pixels from ({x}, {y}) out of a picture of"
            f" {size_px[0]} x {size_px[1]}."
        )
    return Window(x, y, width, height, *binning)


def check_picture(
    document: CalibrationDocument, seen: Window, size_px: tuple[int, int] | None
) -> None:
    """Refuses pictures of this size where it is the sensor's, and the file bins or cuts it.

    A camera's driver gives the sensor's size, and some write that of their pictures.
    """
    if size_px is None or size_px == seen.size_px or size_px != document.size_px():
        return
    (width, height), (fewer, lower) = size_px, seen.size_px
    raise document.refuse(
        f"bins {seen.binning_x} x {seen.binning_y} pixels into one, or cuts out, so that pictures"
        f" have {fewer} x {lower}; this one has all {width} x {height} of its width and height.",
        "If its width, height, K and P are those of such a picture, remove binning_x, binning_y and"
        " roi from it.",
    )


def raw_eye(document: CalibrationDocument, seen: Window) -> EyeLens:
    """The lens, as these pictures show it; its projection is still to be set."""
    distortion = document.numbers(*DISTORTION)
    check_lens(document, distortion)
    eye = EyeLens(
        camera_matrix=seen.applied(document.matrix((3, 3), *CAMERA_MATRIX)),
        distortion=distortion,
        rotation=document.rotation(*RECTIFICATION),
        projection=np.eye(3),
    )
    return checked_eye(document, eye, "K")


def projection(document: CalibrationDocument, seen: Window) -> Array:
    """(3, 4), px: of these pictures, rectified."""
    return seen.applied(document.matrix((3, 4), *PROJECTION))


def _is_given(document: CalibrationDocument, name: str) -> bool:
    entry = document.entries.get(name, "")
    return not (isinstance(entry, str) and entry.lower() in NO_ENTRY)


def _whole(document: CalibrationDocument, name: str) -> int:
    """Not negative; 0 where the file does not say."""
    if not _is_given(document, name):
        return 0
    found = document.matrix((1,), name)[0]
    if found < 0 or not float(found).is_integer():
        raise document.refuse(f"has {found:g} under {name}.")
    return int(found)
