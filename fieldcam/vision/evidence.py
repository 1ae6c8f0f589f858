"""What the verdict on a capture is made from."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.vision.judging.eye_matches import EyeMatches

from fieldcam.calibration.drift import tag_size_error
from fieldcam.values import (
    Calibration,
    DisparityWindow,
    Expectation,
    Fruitlet,
    Region,
    TagPose,
)


@dataclass(frozen=True, slots=True, eq=False)
class Quality:
    """Measures of one pair, from its pixels; greys are 0 to 255 of the left eye."""

    fruit_brightness: float | None
    """Median grey of the fruitlets; None where there are none."""
    white_level: float
    """Grey that 5 % of the region around the tag reach, or of the middle without a tag."""
    right_white_ratio: float
    """That level of the whole right eye over that of the whole left eye."""
    clipped_share: float
    """Share of clipped pixels: of the fruitlets, or of all that is lit where there are none."""
    tag_blur_px: float | None
    """Standard deviation of the blur across the tag's edges, in its worst direction."""
    edge_blur_px: float | None
    """The same of the region's sharpest edges; None where the tag tells it or nothing is seen,
    infinite where what is seen has no edge."""
    depth_share: float
    """Share of the fruitlets' pixels that have a disparity."""
    eyes: EyeMatches


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
    faint_px: tuple[tuple[float, float], ...]
    """Middles (x, y) of what looks a little like a fruitlet."""
    window: DisparityWindow
    calibration: Calibration
    region: Region
    """The part of the left image that was searched."""
    quality: Quality
    tag_size_mm: float
    torn: tuple[str, ...] = ()
    """Eyes whose image lacks a part."""
    other_family: str = ""
    """Of a tag that was seen where none of ours was read; empty where there is none."""

    @property
    def tag_size_error(self) -> float | None:
        """(measured - printed) / printed side; None where it was not triangulated."""
        if self.tag is None or self.right_tag is None:
            return None
        return tag_size_error((self.tag, self.right_tag), self.calibration, self.tag_size_mm)

    @property
    def target(self) -> tuple[Fruitlet, ...]:
        """The fruitlets of the tagged cluster."""
        return tuple(f for f in self.fruitlets if f.in_target)
