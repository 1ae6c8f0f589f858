"""Whether the networks understood what hangs beside the tag.

A fruitlet that the segmentation misses leaves traces: a place that looks a little like
one, a detection that is too unsure to be sized, fruit that no cluster claims. Few of
them are usual. Many beside few fruitlets mean a look that the network does not know,
and a number that looks right.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcam.values import Flag, Fruitlet, ReasonCode, Region, TagPose
from fieldcam.vision.judging.evidence import Evidence
from fieldcam.vision.judging.findings import Finding, confirm
from fieldcam.words import number_of

Place = tuple[float, float]
"""x and y in the image, px."""

REACH_MM = 45.0
"""How far from the middle of the target's fruitlets a missed one can hang."""
DEPTH_REACH_MM = 35.0
MAX_UNSURE = 0.5
"""Unsure places for each fruitlet of the target, beyond which it is asked."""
AROUND_PX = 4


def judge_doubt(evidence: Evidence, unsure_px: Sequence[Place]) -> Iterator[Finding]:
    """A question where too much beside the tag may be fruit that was not found."""
    if len(unsure_px) > MAX_UNSURE * len(evidence.target):
        more = number_of(len(unsure_px), "place")
        text = f"{more} beside the tag may be fruit that was not measured: count them."
        yield confirm(ReasonCode.UNSURE_FRUIT, text)


def unsure_places(evidence: Evidence) -> tuple[Place, ...]:
    """Middles (x, y) in the image of what may be fruitlets of the target."""
    target, tag = evidence.target, evidence.tag
    if tag is None or not target:
        return ()
    faint = [p for p in evidence.faint_px if _beside(p, _range_at(evidence, p), evidence, tag)]
    unsized = [f.center_px for f in target if Flag.BAD_OUTLINE in f.flags]
    # Fruit without depth has a reason of its own.
    others = (f for f in evidence.fruitlets if not f.in_target and Flag.NO_DEPTH not in f.flags)
    apart = [f.center_px for f in others if _beside(f.center_px, f.range_mm, evidence, tag)]
    return (*faint, *unsized, *apart)


def _range_at(evidence: Evidence, place: Place) -> float | None:
    """Median range around a place of the image; None where nothing is known."""
    column, row = round(place[0]), round(place[1])
    near = evidence.window.over(Region(column, row, column + 1, row + 1).grown(AROUND_PX))
    known = near[np.isfinite(near)]
    return evidence.calibration.range_mm(float(np.median(known))) if known.size else None


def _beside(place: Place, range_mm: float | None, evidence: Evidence, tag: TagPose) -> bool:
    """Whether something at a place of the image can belong to the target."""
    target = evidence.target
    middle = np.median([f.center_px for f in target], axis=0)
    cluster_mm = _cluster_range_mm(target, tag)
    if cluster_mm is None:
        return True
    gap_px = float(np.hypot(*(np.array(place) - middle)))
    if gap_px > REACH_MM * evidence.calibration.px_per_mm(cluster_mm):
        return False
    return range_mm is None or abs(range_mm - cluster_mm) < DEPTH_REACH_MM


def _cluster_range_mm(target: tuple[Fruitlet, ...], tag: TagPose) -> float | None:
    ranges = [f.range_mm for f in target if f.range_mm is not None]
    return float(np.median(ranges)) if ranges else tag.range_mm
