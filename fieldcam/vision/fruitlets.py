"""Puts together what the stages say about one fruitlet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fieldcam.values import Calibration, Flag, Fruitlet, Instance, ReasonCode, Verdict
from fieldcam.vision.clouds import FruitletCloud
from fieldcam.vision.clustering import Community
from fieldcam.vision.sizing.diameters import SizedOutline

UNRELATED_EYES = {ReasonCode.SWAPPED_EYES, ReasonCode.MISPAIRED}
"""Reasons for which a disparity means nothing."""


def make_fruitlet(
    index: int,
    instance: Instance,
    cloud: FruitletCloud,
    size: SizedOutline,
    calibration: Calibration,
    groups: Sequence[Community],
    target: Community,
) -> Fruitlet:
    """The fruitlet behind an instance; `groups` and `target` hold instances' indices."""
    center = size.outline.center_px if size.outline else instance.visible.center_px
    cluster = next((k for k, group in enumerate(groups) if index in group), None)
    return Fruitlet(
        id=index,
        in_target=index in target,
        diameter_mm=size.diameter_mm,
        center_px=center,
        box_px=instance.box_px,
        score=instance.score,
        disparity_px=size.disparity_px,
        range_mm=None if size.disparity_px is None else calibration.range_mm(size.disparity_px),
        visible_fraction=size.visible_fraction,
        flags=size.flags,
        mask=instance.visible,
        outline=size.outline,
        cluster=cluster,
        centroid_mm=cloud.centroid_mm,
        cloud_mm=cloud.points_mm,
        sd_mm=None if size.diameter_mm is None else size.sd_mm,
    )


def as_trusted(fruitlets: tuple[Fruitlet, ...], verdict: Verdict) -> tuple[Fruitlet, ...]:
    """The fruitlets; without anything that rests on depth where the eyes do not belong together."""
    if UNRELATED_EYES.isdisjoint(reason.code for reason in verdict.reasons):
        return fruitlets
    return tuple(_as_one_eye_sees(fruitlet) for fruitlet in fruitlets)


def _as_one_eye_sees(fruitlet: Fruitlet) -> Fruitlet:
    return replace(
        fruitlet, in_target=False, diameter_mm=None, sd_mm=None, disparity_px=None, range_mm=None,
        flags=(Flag.NO_DEPTH,), cluster=None, centroid_mm=None, cloud_mm=fruitlet.cloud_mm[:0],
    )  # fmt: skip
