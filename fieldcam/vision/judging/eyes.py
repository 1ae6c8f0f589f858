"""Whether left and right belong together: eyes in order, of one moment, as calibrated.

A drift cannot be cured by another picture, but nothing measured with it can be
trusted: a small one asks for a look, a large one stops the walk (RETAKE).
"""

from __future__ import annotations

from collections.abc import Iterator

from fieldcam.calibration.drift import (
    DRIFT_SIZE,
    TagMatch,
    row_disagreement_px,
    size_off,
    tag_disparity_px,
    unbiased,
)
from fieldcam.values import FARTHEST_MM, NEAREST_MM, ReasonCode, TagPose
from fieldcam.vision.judging.evidence import Evidence
from fieldcam.vision.judging.eye_matches import EyeMatches
from fieldcam.vision.judging.findings import Finding, confirm, retake

DRIFT_ROWS_PX, BAD_DRIFT_ROWS_PX = 1.2, 2.0
BAD_DRIFT_SIZE = 0.03
"""Above the first, and above DRIFT_SIZE, a reading can be looked at; above the second, and above
this, it cannot be trusted."""
MOVED_SIZE = 0.015
"""With rows that are off as well, the camera moved between the eyes' pictures."""
MISPAIRED_ROWS_PX = 8.0
"""A quarter of a degree: a mount that gave way by more would have come off."""
MISPAIRED_SIZE = 0.08
MIN_MATCHES = 6
MIN_FOUND = 0.4
"""Share of spots found again: below it the eyes show different things."""
SWAPPED_SHARE = 0.7
MISPAIRED_SPREAD_PX = 4.0

SWAPPED = retake(
    ReasonCode.SWAPPED_EYES,
    "Left and right are swapped: check cables and names (of a USB camera in camera.toml).",
)
MISPAIRED = retake(
    ReasonCode.MISPAIRED, "Left and right are not of the same moment: take it again."
)
DRIFT_TEXT = "The eyes have moved: calibrate again with `fieldcam calibrate`."


def judge_eyes(evidence: Evidence, spoiled: bool) -> Iterator[Finding]:
    """Whether both eyes show one moment, as calibrated; `spoiled`: too bad to tell from spots."""
    if evidence.tag is not None and evidence.right_tag is not None:
        match = (evidence.tag, evidence.right_tag)
        if tag_disparity_px(match) < 0:
            yield SWAPPED
        elif _in_range(evidence.tag):
            # Bleeding light and smeared edges move the tag's corners by themselves.
            found = _eyes_by_tag(evidence, match)
            yield from (f for f in found if f[1].code is ReasonCode.MISPAIRED or not spoiled)
    elif not spoiled:
        yield from _eyes_by_spots(evidence)


def _in_range(tag: TagPose) -> bool:
    """Whether the tag is where its corners were found to be exact enough."""
    return tag.range_mm is not None and NEAREST_MM <= tag.range_mm <= FARTHEST_MM


def _eyes_by_tag(evidence: Evidence, match: TagMatch) -> Iterator[Finding]:
    rows_px = row_disagreement_px(match)
    error = evidence.tag_size_error
    size = size_off(error)
    resized = error is None or abs(unbiased(error)) > MOVED_SIZE
    moved = resized or evidence.quality.eyes.nearer_is_farther_off
    far_off = rows_px > MISPAIRED_ROWS_PX or size > MISPAIRED_SIZE
    cause = _with_size if rows_px <= DRIFT_ROWS_PX and error is not None else _alone
    if far_off or (rows_px > DRIFT_ROWS_PX and moved):
        yield retake(ReasonCode.MISPAIRED, cause(evidence, MISPAIRED[1].text))
    elif rows_px > BAD_DRIFT_ROWS_PX or size > BAD_DRIFT_SIZE:
        yield retake(ReasonCode.CALIBRATION_DRIFT, cause(evidence, DRIFT_TEXT))
    elif rows_px > DRIFT_ROWS_PX or size > DRIFT_SIZE:
        yield confirm(ReasonCode.CALIBRATION_DRIFT, cause(evidence, DRIFT_TEXT))


def _alone(evidence: Evidence, cause: str) -> str:
    return cause


def _with_size(evidence: Evidence, cause: str) -> str:
    """Where only the tag's size is off, the card itself may be of another size."""
    printed_mm = evidence.tag_size_mm
    measured_mm = printed_mm * (1 + unbiased(evidence.tag_size_error or 0.0))
    return (
        f"The tag measures {measured_mm:.1f} mm, and is set up as {printed_mm:g} mm: correct the"
        f" size of the tags if the card has another one (Set-up). Else: {cause}"
    )


def _eyes_by_spots(evidence: Evidence) -> Iterator[Finding]:
    eyes = evidence.quality.eyes
    if (out_of_order := eyes_out_of_order(eyes)) is not None:
        yield out_of_order
    elif eyes.looked_for < MIN_MATCHES or eyes.rows_px is None or eyes.rows_spread_px is None:
        return
    elif abs(eyes.rows_px) > MISPAIRED_ROWS_PX or eyes.rows_spread_px > MISPAIRED_SPREAD_PX:
        yield MISPAIRED
    elif abs(eyes.rows_px) > BAD_DRIFT_ROWS_PX:
        nearer = eyes.nearer_is_farther_off
        yield MISPAIRED if nearer else retake(ReasonCode.CALIBRATION_DRIFT, DRIFT_TEXT)


def eyes_out_of_order(eyes: EyeMatches) -> Finding | None:
    """SWAPPED or MISPAIRED as far as a pair tells that nobody rectified; None too where it
    shows too little.
    """
    if eyes.looked_for < MIN_MATCHES:
        return None
    if eyes.found_share < MIN_FOUND:
        return MISPAIRED
    return SWAPPED if eyes.swapped_share > SWAPPED_SHARE else None
