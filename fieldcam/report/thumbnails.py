"""A cluster cut out of its left picture, its fruitlets outlined and numbered."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np

from fieldcam.report.ink import Canvas, Colour, Point, Rect, Typeface
from fieldcam.values import Fruitlet, ImageU8
from fieldcam.vision.sizing.outline import pixel_outline

SIDE_PX = 360
"""Of a thumbnail, which is square."""
QUALITY = 85
"""Of the JPEG."""
_MARGIN = 0.15
"""About the fruitlets, as a share of what they span."""
_LINE: Colour = (255, 200, 40)
_INK: Colour = (16, 18, 22)
_FACE = Typeface(22, bold=True)


def cluster_thumbnail(left: ImageU8, fruitlets: Mapping[str, Fruitlet]) -> bytes:
    """A JPEG of the cluster's part of the rectified left image, (H, W, 3) or (H, W).

    `fruitlets` are those to outline by what to call them; without any the whole height of
    the image's middle is shown.
    """
    rgb = left if left.ndim == 3 else np.repeat(left[..., None], 3, axis=2)
    outlines = {name: pixel_outline(f.mask) for name, f in fruitlets.items() if f.mask.area_px}
    corner, side = _square(rgb, np.concatenate([*outlines.values(), np.empty((0, 2))]))
    turned = np.array([[1, 0, -corner[0]], [0, 1, -corner[1]]]) * (SIDE_PX / side)
    canvas = Canvas(np.asarray(cv2.warpAffine(rgb, turned, (SIDE_PX, SIDE_PX)), np.uint8))
    shown = {
        name: [_point(p) for p in (points - corner) * (SIDE_PX / side)]
        for name, points in outlines.items()
    }
    for points in shown.values():
        canvas.polyline(points, _INK, 4, alpha=0.35, closed=True)
        canvas.polyline(points, _LINE, 2, closed=True)
    for name, points in shown.items():
        _write(canvas, _point(np.mean(points, axis=0)), name)
    done, data = cv2.imencode(".jpg", canvas.image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    assert done  # only an unknown format fails
    return data.tobytes()


def _square(image: ImageU8, points: np.ndarray) -> tuple[np.ndarray, float]:
    """Corner (2,) and side of what is cut out, in pixels; it may reach over the border."""
    height, width = image.shape[:2]
    if not len(points):
        return np.array([(width - height) / 2, 0.0]), float(height)
    low, high = points.min(axis=0), points.max(axis=0)
    side = float((high - low).max()) * (1 + 2 * _MARGIN)
    return (low + high - side) / 2, side


def _write(canvas: Canvas, at: Point, text: str) -> None:
    half, up = _FACE.width_px(text) / 2, _FACE.cap_height_px / 2
    plate = Rect(at[0] - half, at[1] - up, at[0] + half, at[1] + up).grown(5)
    canvas.panel(plate, _INK, 0.7, 5)
    canvas.text((at[0] - half, at[1] + up), text, _FACE, _LINE)


def _point(xy: np.ndarray) -> Point:
    return float(xy[0]), float(xy[1])
