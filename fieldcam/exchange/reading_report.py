"""The document that `fieldcam size --json` prints; scripts of others rely on it."""

from __future__ import annotations

from msgspec import to_builtins

from fieldcam.exchange.json_form import Json
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
        "center_px": _rounded(tag.center_px, 2),
        "range_mm": _rounded_or_none(tag.range_mm, 1),
    }


def _fruitlet_report(fruitlet: Fruitlet) -> Json:
    return {
        "id": fruitlet.id,
        "in_target": fruitlet.in_target,
        "diameter_mm": _rounded_or_none(fruitlet.diameter_mm, 3),
        "sd_mm": _rounded_or_none(fruitlet.sd_mm, 3),
        "center_px": _rounded(fruitlet.center_px, 2),
        "box_px": _rounded(fruitlet.box_px, 1),
        "score": round(float(fruitlet.score), 4),
        "disparity_px": _rounded_or_none(fruitlet.disparity_px, 2),
        "range_mm": _rounded_or_none(fruitlet.range_mm, 1),
        "visible_fraction": round(float(fruitlet.visible_fraction), 3),
        "flags": [flag.value for flag in fruitlet.flags],
    }


def _rounded(values: tuple[float, ...], digits: int) -> list[float]:
    return [round(float(value), digits) for value in values]


def _rounded_or_none(value: float | None, digits: int) -> float | None:
    return None if value is None else round(float(value), digits)
