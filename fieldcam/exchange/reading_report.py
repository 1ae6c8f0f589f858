"""The document that `fieldcam size --json` prints; scripts of others rely on it."""

from __future__ import annotations

from msgspec import to_builtins

from fieldcam.exchange.json_form import Json
from fieldcam.exchange.rounding import each_rounded, rounded
from fieldcam.values import ClusterReading, Fruitlet, TagPose


def reading_report(reading: ClusterReading) -> Json:
    """The reading for people and scripts, rounded to what means something.

    Pixels are those of the rectified left image.
    """
    return {
        "tag": None if reading.tag is None else _tag_report(reading.tag),
        "verdict": to_builtins(reading.verdict),
        "fruitlets": [_fruitlet_report(fruitlet) for fruitlet in reading.fruitlets],
        "timing_ms": {stage: round(float(ms), 1) for stage, ms in reading.timing_ms.items()},
        "models": dict(reading.models),
    }


def _tag_report(tag: TagPose) -> Json:
    return {
        "id": tag.id,
        "center_px": each_rounded(tag.center_px, 2),
        "range_mm": rounded(tag.range_mm, 1),
    }


def _fruitlet_report(fruitlet: Fruitlet) -> Json:
    return {
        "id": fruitlet.id,
        "in_target": fruitlet.in_target,
        "diameter_mm": rounded(fruitlet.diameter_mm, 3),
        "sd_mm": rounded(fruitlet.sd_mm, 3),
        "center_px": each_rounded(fruitlet.center_px, 2),
        "box_px": each_rounded(fruitlet.box_px, 1),
        "score": round(float(fruitlet.score), 4),
        "disparity_px": rounded(fruitlet.disparity_px, 2),
        "range_mm": rounded(fruitlet.range_mm, 1),
        "visible_fraction": round(float(fruitlet.visible_fraction), 3),
        "flags": [flag.value for flag in fruitlet.flags],
    }
