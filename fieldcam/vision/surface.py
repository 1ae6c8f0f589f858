"""From an outline in pixels and a surface's disparity to a diameter in mm.

The silhouette is where the cone of sight touches the fruitlet. For a sphere of
radius R whose centre is D away, that cone has the half-angle a with
sin a = R / D, and on an image plane at right angles to the line of sight its
radius is r = f tan a. So R = D sin(atan(r / f)). Three things follow that the
paper's baseline * minor / disparity leaves out:

- D belongs to the centre, not to the visible surface: at a distance of s radii
  from the silhouette's centre the surface lies R sqrt(1 - s^2) nearer. Each
  visible pixel gives its own estimate of the centre's depth; their median holds
  for a fruitlet that is partly hidden as well.
- The tangent circle lies in front of the centre; sin(atan) accounts for it.
- Away from the image's middle the image plane is not at right angles to the
  line of sight: lengths are stretched by 1 / cos^2 towards the middle and by
  1 / cos across. The ellipse is turned back before its short axis is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from fieldcam.vision.sizing.ellipse import EllipseFit, to_ellipse
from fieldcam.vision.sizing.parameters import Corrections

from fieldcam.values import BoolMask, Calibration, DisparityWindow, FloatMap, Mask
from fieldcam.vision.clouds import cut

Vectors = npt.NDArray[np.float64]
RIM = 0.85
"""Beyond this share of the radius a surface is too steep for stereo."""
MIN_PIXELS = 20
"""Least number of pixels with depth for a size."""
MAX_PIXELS = 1500
"""Evenly thinned to this many, a surface gives the same medians."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Raw disparity of the trusted pixels of one fruitlet."""

    points_px: Vectors
    """(N, 2) x, y in the image."""
    disparity_px: npt.NDArray[np.float32]
    """(N,)."""

    @classmethod
    def of(cls, mask: Mask, known: BoolMask, window: DisparityWindow) -> Surface:
        """The pixels of a mask's window that are known to lie on the fruitlet."""
        values: FloatMap = cut(window, mask.region)
        rows, columns = np.nonzero(known & np.isfinite(values))
        step = len(rows) // MAX_PIXELS + 1
        rows, columns = rows[::step], columns[::step]
        points = np.stack([columns + mask.x0, rows + mask.y0], axis=1).astype(np.float64)
        return cls(points, values[rows, columns])

    @property
    def median_px(self) -> float | None:
        """Median disparity; None where there is too little to go by."""
        enough = len(self.disparity_px) >= MIN_PIXELS
        return float(np.median(self.disparity_px)) if enough else None


def diameter_and_spread(
    fit: EllipseFit, surface: Surface, calibration: Calibration, corrections: Corrections
) -> tuple[float, float]:
    """Equatorial diameter, and the robust spread of the depths behind it, both in mm."""
    focal = calibration.focal_px
    ray, short_px = fit.center_px, fit.ellipse.minor_px
    oblique = 1.0
    if corrections.perspective:
        offset = (np.array(ray) - (calibration.cx_px, calibration.cy_px)) / focal
        oblique = float(np.sqrt(1 + offset @ offset))
        short_px = to_ellipse(ray, _facing(fit.shape, offset)).minor_px
    s = fit.radius_at(surface.points_px)
    used = s < RIM if (s < RIM).sum() >= MIN_PIXELS else np.ones(len(s), dtype=np.bool_)
    depth = focal * calibration.baseline_mm / surface.disparity_px[used]
    ahead = np.sqrt(np.maximum(1 - s[used] ** 2, 0.0)) if corrections.center_depth else 0.0
    radius = 0.0
    for _ in range(4):
        # Along the line of sight; the surface's bulge is seen from the camera too.
        center = np.median(depth * oblique + radius * ahead)
        radius = _radius(float(center), short_px / 2 / focal, corrections.perspective)
    residual = depth * oblique + radius * ahead - center
    return 2 * radius, float(1.4826 * np.median(np.abs(residual)))


def _radius(distance_mm: float, tangent: float, perspective: bool) -> float:
    return distance_mm * (tangent / np.sqrt(1 + tangent**2) if perspective else tangent)


def _facing(shape: Vectors, offset: Vectors) -> Vectors:
    """The ellipse's matrix on a plane at right angles to its line of sight.

    `offset` (2,) is the centre's distance from the principal point over the
    focal length. Near the centre the image maps to that plane by
    J = cos (1 - (1 - cos) e e^T), with e towards the principal point.
    """
    distance = float(np.linalg.norm(offset))
    if distance < 1e-9:
        return shape
    cosine = 1 / np.sqrt(1 + distance**2)
    toward = offset / distance
    stretch = (np.eye(2) + (1 / cosine - 1) * np.outer(toward, toward)) / cosine
    # |L J^-1 q| = 1; the symmetric root of its square has the same axes.
    turned = shape @ stretch
    values, axes = np.linalg.eigh(turned.T @ turned)
    return np.asarray(axes @ np.diag(np.sqrt(values)) @ axes.T, dtype=np.float64)
