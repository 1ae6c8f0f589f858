"""How blurred a picture is, from the edges of its tag or else from all of its edges.

Both measures are the blur's standard deviation in pixels in its worst direction:
a camera that moved smears only the edges across its path.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import FloatMap, ImageU8, TagPose

Array = npt.NDArray[np.float64]

REACH = 0.11
"""Of the tag's shortest side: the border inside is 1/8 wide, the paper outside about that."""
STEP_PX = 0.25
MARGIN = 0.12
"""Share of a side left out at each end, where the other sides bend the profile."""
PARTS = 8
"""Into which a side is cut, so that a bow or a stain in one does not count."""
LOW, HIGH = 0.2, 0.8
NORMAL_WIDTH = 1.683
"""Standard deviations between these two levels of a blurred step."""
MIN_RISE = 12.0
"""Grey levels; a fainter edge says nothing."""

FINE_PX, COARSE_PX = 1.0, 2.0
"""Two blurs that an edge of the scene is looked at through."""
DIRECTIONS = 4
STRONGEST, MIN_EDGES = 300, 60
"""Edges of one direction: grain outnumbers the scene's edges, but it is weaker."""
SHARPEST = 0.75
"""Quantile of these edges: even a sharp picture has soft ones."""
MIN_SLOPE = 2.0
"""Grey levels per px."""


def tag_blur_px(grey: ImageU8, tag: TagPose) -> float | None:
    """Blur across the tag's sides in an image (H, W), of the worse pair of opposite ones.

    None where it cannot be read.
    """
    corners = np.array(tag.corners_px, np.float64)
    ends = np.roll(corners, -1, axis=0)
    reach_px = REACH * float(np.linalg.norm(ends - corners, axis=1).min())
    sides = [_side_blur_px(grey, corners[i], ends[i], reach_px) for i in range(4)]
    pairs = [[s for s in (sides[i], sides[i + 2]) if s is not None] for i in range(2)]
    blurs = [min(pair) for pair in pairs if pair]
    return max(blurs) if len(blurs) == 2 else None


def edge_blur_px(grey: ImageU8) -> float | None:
    """Blur of the sharpest edges of an image (H, W) in their worst direction; None where too few.

    An edge of blur s seen through Gaussians of 1 and 2 px keeps slopes in the
    ratio sqrt((s^2 + 4) / (s^2 + 1)).
    """
    image = grey.astype(np.float32)
    fine, coarse = _slopes(image, FINE_PX), _slopes(image, COARSE_PX)
    steepness = cv2.magnitude(*fine)
    clear = steepness > MIN_SLOPE
    clear &= steepness >= cv2.dilate(steepness, np.ones((3, 3), np.uint8)) * 0.95
    angle = np.arctan2(fine[1][clear], fine[0][clear])
    sector = np.round(angle / (np.pi / DIRECTIONS)).astype(int) % DIRECTIONS
    both = (steepness[clear], cv2.magnitude(*coarse)[clear])
    slopes = np.stack(both).astype(np.float32)
    blurs = [_blur_of(slopes[:, sector == k]) for k in range(DIRECTIONS)]
    known = [b for b in blurs if b is not None]
    return max(known) if known else None


def _slopes(image: FloatMap, blur_px: float) -> tuple[FloatMap, FloatMap]:
    soft = cv2.GaussianBlur(image, (0, 0), blur_px)
    columns = np.asarray(cv2.Sobel(soft, cv2.CV_32F, 1, 0, scale=1 / 8), np.float32)
    rows = np.asarray(cv2.Sobel(soft, cv2.CV_32F, 0, 1, scale=1 / 8), np.float32)
    return columns, rows


def _blur_of(slopes: FloatMap) -> float | None:
    """Blur of edges by their slopes (2, N) through the finer and the coarser Gaussian."""
    if slopes.shape[1] < MIN_EDGES:
        return None
    fine, coarse = slopes[:, np.argsort(-slopes[0])[:STRONGEST]]
    ratio = float(np.quantile(fine / np.maximum(coarse, 1e-3), SHARPEST))
    squared = min(max(ratio, 1.02), COARSE_PX / FINE_PX - 0.02) ** 2
    return float(np.sqrt((COARSE_PX**2 - squared * FINE_PX**2) / (squared - 1)))


def _side_blur_px(grey: ImageU8, start: Array, end: Array, reach_px: float) -> float | None:
    """Median blur of the parts of one side."""
    length_px = float(np.linalg.norm(end - start))
    along = (end - start) / length_px
    outward = np.array([-along[1], along[0]])
    offsets_px = np.arange(-reach_px, reach_px + STEP_PX / 2, STEP_PX)
    shares = np.linspace(MARGIN, 1 - MARGIN, PARTS * max(2, int(length_px / PARTS)))
    points = (start + shares[:, None] * (end - start))[:, None] + offsets_px[:, None] * outward
    columns, rows = (np.ascontiguousarray(points[..., i], np.float32) for i in range(2))
    grey_levels = cv2.remap(grey, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    profiles = grey_levels.astype(np.float64).reshape(PARTS, -1, len(offsets_px)).mean(axis=1)
    blurs = [b for b in map(_profile_blur_px, profiles) if b is not None]
    return float(np.median(blurs)) if len(blurs) > PARTS // 2 else None


def _profile_blur_px(profile: Array) -> float | None:
    """Blur of one step from black to white, sampled every STEP_PX."""
    # Further in may lie a white cell, further out the background.
    first = int(profile[: len(profile) // 2].argmin())
    last = len(profile) // 2 + int(profile[len(profile) // 2 :].argmax())
    profile = profile[first : last + 1]
    dark, light = float(profile[0]), float(profile[-1])
    if light - dark < MIN_RISE:
        return None
    level = np.maximum.accumulate((profile - dark) / (light - dark))
    low, high = (float(np.interp(cut, level, np.arange(len(level)))) for cut in (LOW, HIGH))
    return (high - low) * STEP_PX / NORMAL_WIDTH
