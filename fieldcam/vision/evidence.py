"""What the verdict on a capture is made from."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.values import Calibration, Expectation, Fruitlet, Region, TagPose


@dataclass(frozen=True, slots=True)
class Quality:
    """Measures of one pair, from its pixels; greys are 0 to 255 of the left eye."""

    brightness: float
    """Median grey of the fruitlets, or of the searched region where there are none."""
    dark_share: float
    """Share of those pixels that are nearly black."""
    saturated_share: float
    """Share of those pixels that are clipped."""
    sharpness: float | None
    """Steepest edges of the tag over its contrast, per px; None without a tag."""
    depth_share: float
    """Share of the fruitlets' pixels that have a disparity."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """All that the verdict may rest on."""

    tag: TagPose | None
    """The tag that counts, in the left eye."""
    right_tag: TagPose | None
    """The same tag in the right eye."""
    tags_seen: tuple[TagPose, ...]
    expectation: Expectation
    fruitlets: tuple[Fruitlet, ...]
    calibration: Calibration
    region: Region
    """The part of the left image that was searched."""
    quality: Quality
    tag_size_mm: float
