"""Drawing with anti-aliased edges and transparency on an RGB image.

Every shape is first drawn as coverage (0 to 255) on its own small window and then
blended in, so that lines end between pixels and overlapping colours stay soft.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import Ellipse, Floats, ImageU8, Region

Colour = tuple[int, int, int]
"""RGB, 0 to 255."""
Point = tuple[float, float]
Coverage = npt.NDArray[np.uint8]

_SHIFT = 4
"""Fractional bits of OpenCV's sub-pixel coordinates."""
_REGULAR, _BOLD = 400, 650


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle in pixels, edges at real numbers."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def center(self) -> Point:
        return (self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2

    def grown(self, margin: float) -> Rect:
        return Rect(self.x0 - margin, self.y0 - margin, self.x1 + margin, self.y1 + margin)


@dataclass(frozen=True, slots=True)
class Typeface:
    """OpenCV's built-in sans serif in one size and weight."""

    size_px: int
    bold: bool = False

    @property
    def weight(self) -> int:
        return _BOLD if self.bold else _REGULAR

    def width_px(self, text: str) -> float:
        """How far the text reaches to the right."""
        if not text:
            return 0.0
        box = cv2.getTextSize((8192, 256), text, (0, 128), _font(), self.size_px, self.weight)
        return float(box[0] + box[2])

    @property
    def cap_height_px(self) -> float:
        """Height of a capital letter."""
        return 0.72 * self.size_px


class Canvas:
    """An RGB image that is drawn on in place."""

    def __init__(self, image: ImageU8) -> None:
        self.image = image

    @property
    def bounds(self) -> Rect:
        height, width = self.image.shape[:2]
        return Rect(0, 0, width, height)

    def text(self, at: Point, text: str, face: Typeface, colour: Colour) -> None:
        """Write a line; `at` is the left end of its baseline."""
        width = math.ceil(face.width_px(text)) + 4
        height = 2 * face.size_px
        x, y = round(at[0]), round(at[1])
        coverage = np.zeros((height, width), np.uint8)
        rgb = np.zeros((height, width, 3), np.uint8)
        baseline = (2, round(1.4 * face.size_px))
        cv2.putText(rgb, text, baseline, (255, 255, 255), _font(), face.size_px, face.weight)
        coverage[:] = rgb[..., 0]
        self._blend(x - baseline[0], y - baseline[1], coverage, colour, 1.0)

    def panel(self, rect: Rect, colour: Colour, alpha: float, radius_px: float = 0.0) -> None:
        """Fill a rectangle with rounded corners."""
        radius = min(radius_px, (rect.x1 - rect.x0) / 2, (rect.y1 - rect.y0) / 2)
        corners = _rounded(rect, radius)
        window, x, y = self._window(corners, 1.0)
        cv2.fillPoly(window, [_fixed(corners, x, y)], 255, cv2.LINE_AA, _SHIFT)
        self._blend(x, y, window, colour, alpha)

    def polyline(
        self,
        points: Sequence[Point],
        colour: Colour,
        width_px: float,
        alpha: float = 1.0,
        closed: bool = False,
    ) -> None:
        """Draw connected straight lines."""
        window, x, y = self._window(points, width_px)
        thickness = max(1, round(width_px))
        cv2.polylines(
            window, [_fixed(points, x, y)], closed, 255, thickness, cv2.LINE_AA, _SHIFT
        )  # fmt: skip
        self._blend(x, y, window, colour, alpha)

    def dot(self, at: Point, radius_px: float, colour: Colour, alpha: float = 1.0) -> None:
        """Fill a small circle."""
        around = circle(at, radius_px)
        window, x, y = self._window(around, 1.0)
        cv2.fillPoly(window, [_fixed(around, x, y)], 255, cv2.LINE_AA, _SHIFT)
        self._blend(x, y, window, colour, alpha)

    def tint(self, x0: int, y0: int, coverage: Coverage, colour: Colour, alpha: float) -> None:
        """Blend a colour in where `coverage` says so; its first pixel lies at (x0, y0)."""
        self._blend(x0, y0, coverage, colour, alpha)

    def _window(self, points: Sequence[Point], margin_px: float) -> tuple[Coverage, int, int]:
        """Empty coverage around points, cut to the image, and its corner in the image."""
        grow = math.ceil(margin_px) + 2
        xs, ys = [p[0] for p in points], [p[1] for p in points]
        height, width = self.image.shape[:2]
        x0, y0 = max(0, math.floor(min(xs)) - grow), max(0, math.floor(min(ys)) - grow)
        x1 = min(width, math.ceil(max(xs)) + grow)
        y1 = min(height, math.ceil(max(ys)) + grow)
        # OpenCV draws on no empty array, and what lies beyond the border has no window.
        return np.zeros((max(1, y1 - y0), max(1, x1 - x0)), np.uint8), x0, y0

    def _blend(self, x0: int, y0: int, coverage: Coverage, colour: Colour, alpha: float) -> None:
        height, width = self.image.shape[:2]
        own = Region(x0, y0, x0 + coverage.shape[1], y0 + coverage.shape[0])
        seen = own.overlap(Region.whole(width, height))
        part = coverage[seen.slices_in(own)][..., None].astype(np.float32) * (alpha / 255)
        under = self.image[seen.slices]
        under[:] = np.rint(under + (np.array(colour, np.float32) - under) * part).astype(np.uint8)


def circle(center: Point, radius_px: float, corners: int = 24) -> list[Point]:
    """A closed line that looks round."""
    around = Ellipse(center, 2 * radius_px, 2 * radius_px, 0.0).points_px(corners)
    return [point(xy) for xy in around]


def point(xy: Floats) -> Point:
    """Of x and y (2,)."""
    return float(xy[0]), float(xy[1])


def _font() -> cv2.FontFace:
    return cv2.FontFace("sans")


def _fixed(points: Sequence[Point], x0: int, y0: int) -> npt.NDArray[np.int32]:
    """(N, 1, 2) int32: the points in OpenCV's fixed-point coordinates of a window."""
    moved = np.asarray(points, np.float64) - (x0, y0)
    return np.rint(moved * (1 << _SHIFT)).astype(np.int32).reshape(-1, 1, 2)


def _rounded(rect: Rect, radius: float) -> list[Point]:
    if radius <= 0:
        return [(rect.x0, rect.y0), (rect.x1, rect.y0), (rect.x1, rect.y1), (rect.x0, rect.y1)]
    centers = [
        (rect.x1 - radius, rect.y1 - radius, 0.0),
        (rect.x0 + radius, rect.y1 - radius, 0.5),
        (rect.x0 + radius, rect.y0 + radius, 1.0),
        (rect.x1 - radius, rect.y0 + radius, 1.5),
    ]
    return [
        (cx + radius * math.cos(t * math.pi), cy + radius * math.sin(t * math.pi))
        for cx, cy, start in centers
        for t in np.linspace(start, start + 0.5, 9)
    ]
