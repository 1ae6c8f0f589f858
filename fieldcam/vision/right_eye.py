"""Finds in the right eye the tag that the left eye read."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Protocol

import numpy as np
from fieldcam.vision.tags.detection import choose_tag

from fieldcam.values import TAG_SIZE_MM, Calibration, ImageU8, Region, TagPose
from fieldcam.vision.regions import whole

MIN_CROP_PX = 32


class TagReader(Protocol):
    """What reads the tags of one image."""

    def __call__(
        self,
        image: ImageU8,
        calibration: Calibration | None = None,
        tag_size_mm: float = TAG_SIZE_MM,
    ) -> tuple[TagPose, ...]: ...


def find_in_right(
    read_tags: TagReader, right: ImageU8, tag: TagPose | None, calibration: Calibration
) -> TagPose | None:
    """The same tag in the right image, without a pose: where it should be, else anywhere."""
    if tag is None:
        return None
    everywhere = whole(right.shape[1], right.shape[0])
    for region in (expected_region(tag, calibration, everywhere), everywhere):
        if region is None:
            continue
        found = read_tags(np.ascontiguousarray(right[region.slices]), None)
        same = [_moved(t, region) for t in found if t.id == tag.id]
        if same:
            return choose_tag(same, tag.id, (everywhere.width, everywhere.height))
    return None


def expected_region(tag: TagPose, calibration: Calibration, image: Region) -> Region | None:
    """Where the right eye should see the same tag, with a tag's width to spare."""
    if tag.range_mm is None:
        return None
    columns = [x for x, _ in tag.corners_px]
    rows = [y for _, y in tag.corners_px]
    spare = max(max(columns) - min(columns), max(rows) - min(rows))
    shift = calibration.disparity_px(tag.range_mm)
    region = Region(
        max(math.floor(min(columns) - shift - spare), 0),
        max(math.floor(min(rows) - spare), 0),
        min(math.ceil(max(columns) - shift + spare), image.width),
        min(math.ceil(max(rows) + spare), image.height),
    )
    large_enough = min(region.width, region.height) >= MIN_CROP_PX
    return region if large_enough else None


def _moved(tag: TagPose, region: Region) -> TagPose:
    """A tag found in a crop, in pixels of the whole image."""
    x, y = tag.center_px
    return replace(
        tag,
        center_px=(x + region.x0, y + region.y0),
        corners_px=tuple((cx + region.x0, cy + region.y0) for cx, cy in tag.corners_px),
    )
