"""The verdict on a capture: keep it, look at it, or take it again.

Thresholds come from good pairs spoiled in image space and from photographs
(`python -m export.tune_verdict` prints what they separate), never from the
simulator's own faults, on which the verdict is measured.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fieldcam.values import (
    FARTHEST_MM,
    NEAREST_MM,
    Flag,
    Fruitlet,
    ReasonCode,
    Status,
    TagPose,
    Verdict,
)
from fieldcam.vision.judging.doubt import Place, judge_doubt
from fieldcam.vision.judging.evidence import Evidence, Quality
from fieldcam.vision.judging.eyes import judge_eyes
from fieldcam.vision.judging.findings import Finding, confirm, retake
from fieldcam.words import number_of

MIN_FRUIT_BRIGHTNESS = 50.0
MIN_WHITE_LEVEL = 50.0
"""Where no fruitlet was found."""
MIN_RIGHT_WHITE_RATIO = 0.5
MAX_CLIPPED = 0.1
MAX_CLIPPED_AROUND = 0.3
"""Where no fruitlet was found."""
MAX_TAG_BLUR_PX = 2.1
MAX_EDGE_BLUR_PX = 2.2

MIN_PX_PER_MM = 2.7
"""The paper's head has 2.9 at the far end of its range; rendered pairs at 1.8 give sizes that
are 1 mm off, and lose a fifth of the fruitlets."""
MIN_DEPTH = 0.4
BORDER_MM = 5.0
"""A fruitlet nearer the border has neighbours that may be outside."""
TAG_BORDER_MM, EMPTY_TAG_BORDER_MM = 20.0, 45.0
"""Of the tag's centre; the second where no fruitlet was found beside it."""
CLUSTER_MM = 65.0
"""How far from its tag's centre a fruitlet can hang."""


def judge(evidence: Evidence, unsure_px: Sequence[Place]) -> Verdict:
    """The verdict, with every reason that holds; causes stand before consequences.

    `unsure_px` are the places that `unsure_places` finds in the evidence.
    """
    light = list(_light(evidence.quality))
    eyes = list(judge_eyes(evidence, spoiled=bool(light)))
    torn = list(_torn(evidence))
    spoiled = [*torn, *light, *eyes]
    tag = _tag(evidence, spoiled=bool(torn or light))
    findings = [*spoiled, *tag, *_fruit(evidence, explained=bool(spoiled))]
    if not spoiled:
        findings += judge_doubt(evidence, unsure_px)
    reasons = tuple(reason for _, reason in findings)
    statuses = {status for status, _ in findings}
    worst = (s for s in (Status.RETAKE, Status.CONFIRM) if s in statuses)
    return Verdict(next(worst, Status.ACCEPT), reasons)


def _torn(evidence: Evidence) -> Iterator[Finding]:
    if evidence.torn:
        eyes = f"The {evidence.torn[0]} picture lacks"
        if len(evidence.torn) > 1:
            eyes = "Both pictures lack"
        yield retake(ReasonCode.TORN, f"{eyes} a part: its file is damaged, take it again.")


def _light(quality: Quality) -> Iterator[Finding]:
    if _too_dark(quality):
        yield retake(ReasonCode.TOO_DARK, "The picture is too dark: check the flash.")
    elif quality.right_white_ratio < MIN_RIGHT_WHITE_RATIO:
        yield retake(ReasonCode.TOO_DARK, "The right eye is too dark: check its lens and flash.")
    if quality.clipped_share > _most_clipped(quality):
        yield retake(ReasonCode.OVEREXPOSED, "The picture is overexposed: lower the exposure.")
    if _blurred(quality):
        yield retake(ReasonCode.BLURRED, "The picture is blurred: hold still, wipe the lens.")


def _too_dark(quality: Quality) -> bool:
    if quality.fruit_brightness is not None:
        return quality.fruit_brightness < MIN_FRUIT_BRIGHTNESS
    return quality.white_level < MIN_WHITE_LEVEL


def _most_clipped(quality: Quality) -> float:
    return MAX_CLIPPED_AROUND if quality.fruit_brightness is None else MAX_CLIPPED


def _blurred(quality: Quality) -> bool:
    if quality.tag_blur_px is not None:
        return quality.tag_blur_px > MAX_TAG_BLUR_PX
    return quality.edge_blur_px is not None and quality.edge_blur_px > MAX_EDGE_BLUR_PX


def _tag(evidence: Evidence, spoiled: bool) -> Iterator[Finding]:
    """`spoiled`: a picture in which no tag could be read."""
    tag, expected = evidence.tag, evidence.expectation.tag_id
    if tag is None:
        yield retake(ReasonCode.NO_TAG, _no_tag(evidence, spoiled))
        return
    if expected is not None and tag.id != expected:
        yield retake(
            ReasonCode.WRONG_TAG, f"Tag {tag.id} was read, {expected} is due: find that one."
        )
    ids = [t.id for t in evidence.tags_seen]
    if ids.count(tag.id) > 1 or (expected is None and len(set(ids)) > 1):
        yield confirm(
            ReasonCode.SEVERAL_TAGS, f"Several tags in view, tag {tag.id} was taken: is it right?"
        )
    range_mm = tag.range_mm
    if range_mm is not None and range_mm < NEAREST_MM:
        yield retake(ReasonCode.TOO_NEAR, f"The tag is {range_mm / 10:.0f} cm away: step back.")
    if range_mm is not None and range_mm > FARTHEST_MM:
        yield retake(ReasonCode.TOO_FAR, f"The tag is {range_mm / 10:.0f} cm away: go nearer.")

    if range_mm is not None and _coarse(evidence, range_mm) and range_mm <= FARTHEST_MM:
        fine = evidence.calibration.px_per_mm(range_mm)
        text = f"Too coarse: {fine:.1f} of {MIN_PX_PER_MM} pixels a mm."
        yield retake(ReasonCode.TOO_COARSE, f"{text} Go nearer, or switch binning off.")


def _no_tag(evidence: Evidence, spoiled: bool) -> str:
    """By what is seen of the cause."""
    if spoiled:
        return "No tag could be read in it."
    if evidence.other_family:
        return f"A tag of {evidence.other_family} is in view: only tag36h11 is read, print cards."
    return "No tag was read: aim at it, turn it to the camera, clear leaves."


def _coarse(evidence: Evidence, range_mm: float) -> bool:
    return evidence.calibration.focal_px < MIN_PX_PER_MM * range_mm


def _fruit(evidence: Evidence, explained: bool) -> Iterator[Finding]:
    """What is wrong with the cluster; `explained`: why nothing was measured is said already."""
    if evidence.tag is None:
        return
    target, before = evidence.target, evidence.expectation.fruitlets
    at_border = _at_border(evidence, evidence.tag)
    if at_border:
        yield retake(
            ReasonCode.CUT_BY_BORDER, "The cluster is cut off by the border: aim at its middle."
        )
    if not target:
        if not (explained or at_border):
            yield _nothing(evidence, evidence.tag)
        return
    if not explained and _lost(evidence, evidence.tag) >= len(target):
        yield NO_DEPTH
    if before is not None and len(target) < before:
        seen = number_of(len(target), "fruitlet")
        text = f"{seen}, last visit {before}: fallen, or hidden by a leaf?"
        yield confirm(ReasonCode.FEWER_THAN_BEFORE, text)


NO_DEPTH = retake(ReasonCode.NO_DEPTH, "No depth was measured: wipe both lenses, take it again.")


def _nothing(evidence: Evidence, tag: TagPose) -> Finding:
    near = any(_near(evidence, f, tag) for f in evidence.fruitlets)
    if near and evidence.quality.depth_share < MIN_DEPTH:
        return NO_DEPTH
    return retake(ReasonCode.NO_FRUITLETS, "No fruitlets were found: aim at the tag's cluster.")


def _at_border(evidence: Evidence, tag: TagPose) -> bool:
    """Whether the tagged cluster touches the border of either eye's picture."""
    if tag.range_mm is None:
        return False
    px_per_mm = evidence.calibration.px_per_mm(tag.range_mm)
    x, y = tag.center_px
    tag_border_mm = TAG_BORDER_MM if evidence.target else EMPTY_TAG_BORDER_MM
    if _border_gap_px(evidence, tag, (x, y, x, y)) < tag_border_mm * px_per_mm:
        return True
    own = (f for f in evidence.fruitlets if f.in_target or _near(evidence, f, tag))
    return any(_border_gap_px(evidence, tag, f.box_px) < BORDER_MM * px_per_mm for f in own)


def _lost(evidence: Evidence, tag: TagPose) -> int:
    """How many fruitlets beside the tag have no depth, so that whose they are is not known."""
    beside = (f for f in evidence.fruitlets if f.in_target or _near(evidence, f, tag))
    return sum(Flag.NO_DEPTH in f.flags for f in beside)


def _near(evidence: Evidence, fruitlet: Fruitlet, tag: TagPose) -> bool:
    """Whether a fruitlet, of whatever range, may belong to the tag's cluster."""
    if tag.range_mm is None:
        return True
    (u, v), (x, y) = fruitlet.center_px, tag.center_px
    reach_px = CLUSTER_MM * evidence.calibration.px_per_mm(tag.range_mm)
    return (u - x) ** 2 + (v - y) ** 2 < reach_px**2


def _border_gap_px(
    evidence: Evidence, tag: TagPose, box_px: tuple[float, float, float, float]
) -> float:
    """From a box at the tag's range to the nearest border of the left or the right eye."""
    camera = evidence.calibration
    shift = 0.0 if tag.range_mm is None else camera.disparity_px(tag.range_mm)
    x0, y0, x1, y1 = box_px
    return min(x0 - shift, y0, camera.width_px - 1 - x1, camera.height_px - 1 - y1)
