"""The verdict on a capture: keep it, look at it, or take it again."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.calibration.drift import row_disagreement_px, tag_disparity_px, tag_size_error
from fieldcam.values import (
    DisparityWindow,
    Flag,
    Fruitlet,
    ImageU8,
    Reason,
    ReasonCode,
    Region,
    Status,
    StereoPair,
    TagPose,
    Verdict,
)
from fieldcam.vision.clouds import cut
from fieldcam.vision.evidence import Evidence, Quality
from fieldcam.vision.stereo import gray

DARK, CLIPPED = 8, 250
LEAST_BRIGHTNESS = 22.0
MOST_CLIPPED = 0.15
LEAST_SHARPNESS = 0.12
LEAST_DEPTH = 0.4
NEAREST_MM, FARTHEST_MM = 280.0, 620.0
MISPAIRED_ROWS_PX = 4.0
DRIFT_ROWS_PX = 1.5
MISPAIRED_SIZE, DRIFT_SIZE = 0.12, 0.025

CONFIRMABLE = {
    ReasonCode.FEWER_THAN_BEFORE,
    ReasonCode.SEVERAL_TAGS,
    ReasonCode.CALIBRATION_DRIFT,
}
"""Only the operator's eyes can settle these; every other reason asks for a retake."""


def judge(evidence: Evidence) -> Verdict:
    """The verdict, with every reason that holds."""
    reasons = tuple([*_tag(evidence), *_light(evidence), *_eyes(evidence), *_fruit(evidence)])
    if not reasons:
        return Verdict(Status.ACCEPT)
    confirm = all(reason.code in CONFIRMABLE for reason in reasons)
    return Verdict(Status.CONFIRM if confirm else Status.RETAKE, reasons)


def measure_quality(
    pair: StereoPair,
    region: Region,
    tag: TagPose | None,
    window: DisparityWindow,
    fruitlets: tuple[Fruitlet, ...],
) -> Quality:
    """Light, sharpness and depth of a pair."""
    image = gray(pair.left)
    pixels = _fruit_pixels(image, fruitlets) if fruitlets else image[region.slices].ravel()
    depths = [cut(window, f.mask.region)[f.mask.window] for f in fruitlets]
    known = np.isfinite(np.concatenate(depths)) if depths else np.zeros(1)
    return Quality(
        brightness=float(np.median(pixels)),
        dark_share=float((pixels <= DARK).mean()),
        saturated_share=float((pixels >= CLIPPED).mean()),
        sharpness=None if tag is None else _sharpness(image, tag),
        depth_share=float(known.mean()),
    )


def _tag(evidence: Evidence) -> Iterator[Reason]:
    tag, expected = evidence.tag, evidence.expectation.tag_id
    if tag is None:
        yield Reason(ReasonCode.NO_TAG, "No tag was read.")
        return
    if expected is not None and tag.id != expected:
        yield Reason(ReasonCode.WRONG_TAG, f"Tag {tag.id} was read, {expected} is due here.")
    if expected is None and len({t.id for t in evidence.tags_seen}) > 1:
        yield Reason(ReasonCode.SEVERAL_TAGS, f"Several tags in view; tag {tag.id} was taken.")
    if tag.range_mm is not None and tag.range_mm < NEAREST_MM:
        yield Reason(ReasonCode.TOO_NEAR, f"The tag is {tag.range_mm / 10:.0f} cm away: step back.")
    if tag.range_mm is not None and tag.range_mm > FARTHEST_MM:
        yield Reason(ReasonCode.TOO_FAR, f"The tag is {tag.range_mm / 10:.0f} cm away: go nearer.")


def _light(evidence: Evidence) -> Iterator[Reason]:
    quality = evidence.quality
    if quality.brightness < LEAST_BRIGHTNESS:
        yield Reason(ReasonCode.TOO_DARK, "The picture is too dark: did the flash fire?")
    if quality.saturated_share > MOST_CLIPPED:
        yield Reason(ReasonCode.OVEREXPOSED, "The picture is overexposed.")
    if quality.sharpness is not None and quality.sharpness < LEAST_SHARPNESS:
        yield Reason(ReasonCode.BLURRED, "The picture is blurred: hold still.")


def _eyes(evidence: Evidence) -> Iterator[Reason]:
    left, right = evidence.tag, evidence.right_tag
    if left is None or left.translation_mm is None:
        return
    if right is None:
        yield Reason(ReasonCode.MISPAIRED, "The right eye does not see the tag.")
        return
    match = (left, right)
    if tag_disparity_px(match) < 0:
        yield Reason(ReasonCode.SWAPPED_EYES, "Left and right are swapped.")
        return
    rows = row_disagreement_px([match]) or 0.0
    size = abs(tag_size_error(match, evidence.calibration, evidence.tag_size_mm) or 0.0)
    if rows > MISPAIRED_ROWS_PX or size > MISPAIRED_SIZE:
        yield Reason(ReasonCode.MISPAIRED, "Left and right are not of the same moment.")
    elif rows > DRIFT_ROWS_PX or size > DRIFT_SIZE:
        yield Reason(ReasonCode.CALIBRATION_DRIFT, "The calibration no longer fits the camera.")


def _fruit(evidence: Evidence) -> Iterator[Reason]:
    if evidence.tag is None:
        return
    target = [f for f in evidence.fruitlets if f.in_target]
    before = evidence.expectation.fruitlets
    if not target:
        if evidence.fruitlets and evidence.quality.depth_share < LEAST_DEPTH:
            yield Reason(ReasonCode.NO_DEPTH, "The fruitlets' depth could not be measured.")
        else:
            yield Reason(ReasonCode.NO_FRUITLETS, "No fruitlets were found beside the tag.")
        return
    if any(Flag.CUT_BY_BORDER in f.flags for f in target):
        yield Reason(ReasonCode.CUT_BY_BORDER, "A fruitlet is cut off by the picture's border.")
    if all(Flag.NO_DEPTH in f.flags for f in target):
        yield Reason(ReasonCode.NO_DEPTH, "The fruitlets' depth could not be measured.")
    if before is not None and len(target) < before:
        yield Reason(
            ReasonCode.FEWER_THAN_BEFORE,
            f"{len(target)} fruitlets; last visit there were {before}.",
        )


def _fruit_pixels(image: ImageU8, fruitlets: tuple[Fruitlet, ...]) -> npt.NDArray[np.uint8]:
    parts = [image[f.mask.region.slices][f.mask.window] for f in fruitlets]
    return np.concatenate(parts)


def _sharpness(image: ImageU8, tag: TagPose) -> float | None:
    corners = np.array(tag.corners_px)
    low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 4, 0)
    high = np.ceil(corners.max(axis=0)).astype(int) + 5
    patch = image[low[1] : high[1], low[0] : high[0]].astype(np.float32)
    if min(patch.shape) < 8:
        return None
    contrast = float(np.percentile(patch, 90) - np.percentile(patch, 10))
    steep = cv2.magnitude(
        cv2.Scharr(patch, cv2.CV_32F, 1, 0, scale=1 / 32),
        cv2.Scharr(patch, cv2.CV_32F, 0, 1, scale=1 / 32),
    )
    return float(np.percentile(steep, 98)) / max(contrast, 1.0)
