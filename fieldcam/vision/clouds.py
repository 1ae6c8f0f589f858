"""Fruitlets as points in space (paper section III-E, "Fruitlet Clustering").

Disparity is smoothed and cleared of depth edges inside each fruitlet's own
window only; the rest of the image is never touched.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import BoolMask, Calibration, DisparityWindow, FloatMap, Mask, Points, Region

NO_POINTS: Points = np.zeros((0, 3), dtype=np.float32)
FAR_PX = 50.0
"""Unknown disparities are set this far below the others, out of the filter's reach."""
NEIGHBOURS_PX = 2
"""Pixels around a mask that the filters look at; further ones lie on other surfaces."""


@dataclass(frozen=True, slots=True)
class CloudParameters:
    """Filter settings; the authors' values where they are known."""

    bilateral_diameter_px: int = 15
    bilateral_color_px: float = 1.0
    bilateral_space_px: float = 10.0
    jump_ratio: float = 0.004
    """Depth step to a neighbour, over depth, that counts as an edge."""
    min_points: int = 60
    max_from_median_mm: float = 20.0
    max_range_iqr_mm: float = 20.0
    """Range between the quartiles from which on a cloud is smeared: its median is no depth."""
    max_view_axis: float = 1.0
    """A cloud whose longest axis is more parallel than this to the line of sight is smeared.

    The authors' 0.8 also drops small fruitlets whose median is right to a pixel; at
    1 nothing is dropped for it.
    """
    grid_mm: float = 1.0


PAPER_CLOUDS = CloudParameters(min_points=100, max_range_iqr_mm=np.inf, max_view_axis=0.8)


@dataclass(frozen=True, slots=True, eq=False)
class FruitletCloud:
    """The visible surface of one fruitlet; empty where its depth is unusable."""

    points_mm: Points
    """Thinned to the grid."""
    centroid_mm: tuple[float, float, float] | None
    """Median point before thinning."""
    known: BoolMask
    """Over the mask's window: pixels with a trusted disparity."""


def fruitlet_cloud(
    mask: Mask,
    window: DisparityWindow,
    calibration: Calibration,
    parameters: CloudParameters | None = None,
) -> FruitletCloud:
    """Points of one fruitlet's visible surface in the camera frame."""
    parameters = parameters or CloudParameters()
    tight = mask.tight
    region = tight.region.grown(NEIGHBOURS_PX)
    smooth = bilateral(window.over(region), parameters)
    smooth[depth_edges(smooth, parameters.jump_ratio)] = np.nan
    inner = smooth[NEIGHBOURS_PX:-NEIGHBOURS_PX, NEIGHBOURS_PX:-NEIGHBOURS_PX]
    inside = np.where(tight.window, inner, np.nan)
    points, pixels = back_project(inside, tight.region, calibration)
    kept = keep_consistent(points, parameters)
    known = np.zeros(mask.window.shape, dtype=np.bool_)
    if kept is None:
        return FruitletCloud(NO_POINTS, None, known)
    known[pixels[0][kept] + tight.y0 - mask.y0, pixels[1][kept] + tight.x0 - mask.x0] = True
    x, y, z = (float(v) for v in np.median(points[kept], axis=0))
    return FruitletCloud(thinned(points[kept], parameters.grid_mm), (x, y, z), known)


def bilateral(disparity: FloatMap, parameters: CloudParameters) -> FloatMap:
    """Bilateral filter of a disparity map (H, W); unknown pixels stay so and lend nothing."""
    known = np.isfinite(disparity)
    if not known.any():
        return disparity.copy()
    low, high = float(disparity[known].min()), float(disparity[known].max())
    # The filter tabulates its weights over the whole range of values, so a few
    # wild disparities must not stretch it.
    middle = float(np.median(disparity[known]))
    low, high = max(low, middle - 2 * FAR_PX), min(high, middle + 2 * FAR_PX)
    filled = np.where(known, np.clip(disparity, low, high), low - FAR_PX).astype(np.float32)
    smooth = cv2.bilateralFilter(
        filled,
        parameters.bilateral_diameter_px,
        parameters.bilateral_color_px,
        parameters.bilateral_space_px,
        borderType=cv2.BORDER_REPLICATE,
    )
    return np.where(known, smooth, np.nan).astype(np.float32)


def depth_edges(disparity: FloatMap, jump_ratio: float) -> BoolMask:
    """Pixels (H, W) whose depth jumps to a neighbour; unknown neighbours do not count."""
    known = np.isfinite(disparity)
    depth = (1.0 / np.where(known, disparity, 1.0)).astype(np.float32)
    kernel = np.ones((3, 3), np.uint8)
    highest = cv2.dilate(np.where(known, depth, -np.inf).astype(np.float32), kernel)
    lowest = cv2.erode(np.where(known, depth, np.inf).astype(np.float32), kernel)
    jump = np.maximum(np.abs(highest - depth), np.abs(depth - lowest)) / depth
    edges = (known & (jump > jump_ratio)).astype(np.uint8)
    return cv2.morphologyEx(edges, cv2.MORPH_CLOSE, kernel) > 0


def back_project(
    disparity: FloatMap, region: Region, calibration: Calibration
) -> tuple[Points, tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]]:
    """Points (N, 3) in mm of the known pixels of a region, and their rows and columns."""
    rows, columns = np.nonzero(disparity > 0)
    places = np.stack([columns + region.x0, rows + region.y0], axis=1).astype(np.float64)
    range_mm = calibration.range_mm(disparity[rows, columns])
    return calibration.points_mm(places, range_mm).astype(np.float32), (rows, columns)


def keep_consistent(points: Points, parameters: CloudParameters) -> BoolMask | None:
    """Which points (N,) belong to one compact surface; None where there is none."""
    if len(points) < parameters.min_points:
        return None
    middle = np.median(points, axis=0)
    near = np.linalg.norm(points - middle, axis=1) <= parameters.max_from_median_mm
    if near.sum() < parameters.min_points:
        return None
    quartiles = np.percentile(points[:, 2], [25, 75])
    if quartiles[1] - quartiles[0] > parameters.max_range_iqr_mm:
        return None
    view = middle / np.linalg.norm(middle)
    _, axes = np.linalg.eigh(np.cov(points[near].T))
    smeared = abs(float(axes[:, -1] @ view)) > parameters.max_view_axis
    return None if smeared else np.asarray(near, dtype=np.bool_)


def thinned(points: Points, grid_mm: float) -> Points:
    """One mean point (M, 3) for each occupied cell of a grid fixed to the camera frame."""
    if len(points) == 0:
        return NO_POINTS
    cells = np.floor(points / grid_mm).astype(np.int64)
    cells -= cells.min(axis=0)
    extent = cells.max(axis=0) + 1
    keys = (cells[:, 0] * extent[1] + cells[:, 1]) * extent[2] + cells[:, 2]
    _, cell, count = np.unique(keys, return_inverse=True, return_counts=True)
    sums = [np.bincount(cell, weights=points[:, axis]) for axis in range(3)]
    return (np.stack(sums, axis=1) / count[:, None]).astype(np.float32)
