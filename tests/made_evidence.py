"""A good pair's evidence, and what it is made of."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from drawn_tags import IMAGE_CORNERS
from fieldcam.vision.judging.evidence import Evidence, Quality
from fieldcam.vision.judging.eye_matches import EyeMatches
from fieldcam.vision.judging.verdicts import judge

from fieldcam.values import (
    Calibration,
    DisparityWindow,
    Expectation,
    Flag,
    Fruitlet,
    Mask,
    Region,
    TagPose,
)

CAMERA = Calibration(1440, 1080, 1717.0, 719.5, 539.5, 60.0)
TAG_MM = 27.95
SEARCHED = Region(360, 180, 1080, 900)
GAMMA_BIAS = -0.0055
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def make_tag(
    x_mm: float = 0.0, y_mm: float = 0.0, z_mm: float = 440.0, tag_id: int = 17
) -> TagPose:
    """A tag that faces the left eye."""
    scale = CAMERA.focal_px / z_mm
    u, v = CAMERA.cx_px + x_mm * scale, CAMERA.cy_px + y_mm * scale
    half = TAG_MM / 2 * scale
    corners = tuple((u + half * float(a), v + half * float(b)) for a, b in IMAGE_CORNERS)
    return TagPose(tag_id, (u, v), corners, (x_mm, y_mm, z_mm), IDENTITY, 60.0)


def in_right(tag: TagPose, rows_px: float = 0.0, wider: float = GAMMA_BIAS) -> TagPose:
    """The same tag in the right eye, some rows lower, with a disparity that is off."""
    assert tag.range_mm is not None
    # A side measured by triangulation goes with the inverse of the disparity.
    shift = CAMERA.disparity_px(tag.range_mm) / (1 + wider)
    corners = tuple((x - shift, y + rows_px) for x, y in tag.corners_px)
    u, v = tag.center_px
    return replace(tag, center_px=(u - shift, v + rows_px), corners_px=corners, translation_mm=None)


def spots(
    rows_px: float = 0.0, disparity_px: float = 234.0, found: int = 20, slope: float = 0.0
) -> EyeMatches:
    """Spots at many depths; `slope`: rows for each pixel of disparity."""
    disparities = disparity_px * np.linspace(0.6, 1.1, found)
    rows = rows_px + slope * disparities
    return EyeMatches(24, np.column_stack((disparities, rows)))


def make_fruitlet(
    center_px: tuple[float, float] = (860.0, 540.0),
    flags: tuple[Flag, ...] = (),
    in_target: bool = True,
) -> Fruitlet:
    x, y = center_px
    mask = Mask(int(x) - 18, int(y) - 18, np.ones((36, 36), np.bool_))
    box = (x - 18, y - 18, x + 18, y + 18)
    return Fruitlet(
        id=0, in_target=in_target, diameter_mm=9.0, center_px=center_px, box_px=box, score=0.9,
        disparity_px=234.0, range_mm=440.0, visible_fraction=0.9, flags=flags, mask=mask,
        outline=None, cluster=0, centroid_mm=(0.0, 0.0, 440.0),
        cloud_mm=np.zeros((0, 3), np.float32),
    )  # fmt: skip


GOOD_QUALITY = Quality(
    fruit_brightness=120.0, white_level=170.0, right_white_ratio=1.0, clipped_share=0.0,
    tag_blur_px=1.1, edge_blur_px=0.8, depth_share=0.97, eyes=spots(),
)  # fmt: skip


def evidence(**changes: object) -> Evidence:
    """A good pair's evidence; names of Quality's fields change its quality."""
    given: dict[str, Any] = dict(changes)
    measures = {k: given.pop(k) for k in changes if k in Quality.__dataclass_fields__}
    tag = given.get("tag", make_tag())
    parts: dict[str, Any] = {
        "tag": tag,
        "right_tag": None if tag is None else in_right(tag),
        "tags_seen": () if tag is None else (tag,),
        "expectation": Expectation(17, 3),
        "fruitlets": (make_fruitlet(), make_fruitlet((870, 580)), make_fruitlet((900, 540))),
        "faint_px": (),
        "window": DisparityWindow(SEARCHED, np.full((720, 720), 234.0, np.float32)),
        "calibration": CAMERA,
        "region": SEARCHED,
        "quality": replace(GOOD_QUALITY, **measures),
        "tag_size_mm": TAG_MM,
    }
    return Evidence(**(parts | given))


def codes(found: Evidence) -> set[str]:
    return {reason.code.value for reason in judge(found).reasons}


UNREAD: dict[str, Any] = {"tag": None, "right_tag": None, "tag_blur_px": None}
