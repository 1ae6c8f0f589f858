"""Pictures of AprilTags whose corners are known exactly."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import ImageU8

Array = npt.NDArray[np.float64]

SUPERSAMPLING = 8
WHITE_CELLS = 2
"""Width of the white paper around the tag's 8x8 cells."""

IMAGE_CORNERS = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)], dtype=np.float64)
"""Lower left, lower right, upper right, upper left of an upright tag, y down."""


def tag_cells(tag_id: int) -> ImageU8:
    """(12, 12) 0 or 255: an upright tag with its white border."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    # OpenCV draws the family upside down.
    cells = cv2.rotate(cv2.aruco.generateImageMarker(dictionary, tag_id, 8), cv2.ROTATE_180)
    return np.pad(np.asarray(cells, np.uint8), WHITE_CELLS, constant_values=255)


def draw_tag(
    corners_px: Array,
    size_px: tuple[int, int],
    tag_id: int = 17,
    *,
    dark: float = 25.0,
    light: float = 215.0,
    blur_px: float = 0.7,
    noise: float = 2.0,
) -> ImageU8:
    """A grey picture of one tag whose black square has these corners (4, 2).

    Corners in the order of IMAGE_CORNERS, with pixel centres at integers.
    """
    width, height = size_px
    to_tag = cv2.getPerspectiveTransform(
        corners_px.astype(np.float32), IMAGE_CORNERS.astype(np.float32)
    )
    rows, columns = np.mgrid[0 : height * SUPERSAMPLING, 0 : width * SUPERSAMPLING]
    x, y = ((grid + 0.5) / SUPERSAMPLING - 0.5 for grid in (columns, rows))
    u, v, w = np.tensordot(to_tag, np.stack((x, y, np.ones_like(x))), axes=1)
    cells = tag_cells(tag_id)
    column, row = (np.floor((value / w + 1) * 4).astype(int) + WHITE_CELLS for value in (u, v))
    inside = (column >= 0) & (column < len(cells)) & (row >= 0) & (row < len(cells))
    fine = np.full(inside.shape, 128.0, np.float32)
    fine[inside] = cells[row[inside], column[inside]]
    picture = fine.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING).mean((1, 3)) / 255
    picture = cv2.GaussianBlur(dark + (light - dark) * picture, (0, 0), blur_px)
    picture = picture + np.random.default_rng(tag_id).normal(0, noise, picture.shape)
    return np.asarray(np.clip(np.rint(picture), 0, 255), np.uint8)
