"""The parts of a reading as JSON values, and back."""

from __future__ import annotations

from fieldcam.codec import packing
from fieldcam.exchange.json_fields import (
    Json,
    box,
    float_or_none,
    floats,
    number,
    optional,
    point2,
    point3,
    sized,
    text,
    truth,
    whole,
)
from fieldcam.values import (
    Calibration,
    DisparityWindow,
    Ellipse,
    Flag,
    Fruitlet,
    Mask,
    Reason,
    ReasonCode,
    Region,
    Status,
    TagPose,
    Verdict,
)


def encode_calibration(calibration: Calibration) -> Json:
    return {
        "width_px": int(calibration.width_px),
        "height_px": int(calibration.height_px),
        "focal_px": float(calibration.focal_px),
        "cx_px": float(calibration.cx_px),
        "cy_px": float(calibration.cy_px),
        "baseline_mm": float(calibration.baseline_mm),
    }


def decode_calibration(d: Json) -> Calibration:
    return Calibration(
        width_px=whole(d["width_px"]),
        height_px=whole(d["height_px"]),
        focal_px=number(d["focal_px"]),
        cx_px=number(d["cx_px"]),
        cy_px=number(d["cy_px"]),
        baseline_mm=number(d["baseline_mm"]),
    )


def encode_tag(tag: TagPose) -> Json:
    return {
        "id": int(tag.id),
        "center_px": floats(tag.center_px),
        "corners_px": [floats(corner) for corner in tag.corners_px],
        "translation_mm": None if tag.translation_mm is None else floats(tag.translation_mm),
        "rotation": None if tag.rotation is None else [floats(row) for row in tag.rotation],
        "decision_margin": float(tag.decision_margin),
    }


def decode_tag(d: Json) -> TagPose:
    return TagPose(
        id=whole(d["id"]),
        center_px=point2(d["center_px"]),
        corners_px=tuple(point2(corner) for corner in sized(d["corners_px"], 4)),
        translation_mm=optional(d["translation_mm"], point3),
        rotation=optional(d["rotation"], _rotation),
        decision_margin=number(d["decision_margin"]),
    )


def _rotation(rows: object) -> tuple[tuple[float, float, float], ...]:
    return tuple(point3(row) for row in sized(rows, 3))


def encode_verdict(verdict: Verdict) -> Json:
    return {
        "status": verdict.status.value,
        "reasons": [{"code": reason.code.value, "text": reason.text} for reason in verdict.reasons],
    }


def decode_verdict(d: Json) -> Verdict:
    reasons = (Reason(ReasonCode(r["code"]), text(r["text"])) for r in d["reasons"])
    return Verdict(Status(d["status"]), tuple(reasons))


def encode_fruitlet(fruitlet: Fruitlet) -> Json:
    centroid = fruitlet.centroid_mm
    return {
        "id": int(fruitlet.id),
        "in_target": bool(fruitlet.in_target),
        "diameter_mm": float_or_none(fruitlet.diameter_mm),
        "sd_mm": float_or_none(fruitlet.sd_mm),
        "center_px": floats(fruitlet.center_px),
        "box_px": floats(fruitlet.box_px),
        "score": float(fruitlet.score),
        "disparity_px": float_or_none(fruitlet.disparity_px),
        "range_mm": float_or_none(fruitlet.range_mm),
        "visible_fraction": float(fruitlet.visible_fraction),
        "flags": [flag.value for flag in fruitlet.flags],
        "mask": _encode_mask(fruitlet.mask),
        "outline": None if fruitlet.outline is None else _encode_ellipse(fruitlet.outline),
        "cluster": None if fruitlet.cluster is None else int(fruitlet.cluster),
        "centroid_mm": None if centroid is None else floats(centroid),
        "cloud_points": len(fruitlet.cloud_mm),
        "cloud": packing.encode_cloud(fruitlet.cloud_mm),
    }


def decode_fruitlet(d: Json) -> Fruitlet:
    return Fruitlet(
        id=whole(d["id"]),
        in_target=truth(d["in_target"]),
        diameter_mm=optional(d["diameter_mm"], number),
        center_px=point2(d["center_px"]),
        box_px=box(d["box_px"]),
        score=number(d["score"]),
        disparity_px=optional(d["disparity_px"], number),
        range_mm=optional(d["range_mm"], number),
        visible_fraction=number(d["visible_fraction"]),
        flags=tuple(Flag(flag) for flag in d["flags"]),
        mask=_decode_mask(d["mask"]),
        outline=optional(d["outline"], _decode_ellipse),
        cluster=optional(d["cluster"], whole),
        centroid_mm=optional(d["centroid_mm"], point3),
        cloud_mm=packing.decode_cloud(text(d["cloud"]), whole(d["cloud_points"])),
        sd_mm=optional(d.get("sd_mm"), number),
    )


def _encode_mask(mask: Mask) -> Json:
    height, width = mask.window.shape
    return {
        "x0": int(mask.x0),
        "y0": int(mask.y0),
        "width": width,
        "height": height,
        "runs": packing.encode_mask(mask.window),
    }


def _decode_mask(d: Json) -> Mask:
    runs = [whole(length) for length in d["runs"]]
    window = packing.decode_mask(runs, whole(d["width"]), whole(d["height"]))
    return Mask(whole(d["x0"]), whole(d["y0"]), window)


def _encode_ellipse(ellipse: Ellipse) -> Json:
    return {
        "center_px": floats(ellipse.center_px),
        "major_px": float(ellipse.major_px),
        "minor_px": float(ellipse.minor_px),
        "angle_rad": float(ellipse.angle_rad),
    }


def _decode_ellipse(d: Json) -> Ellipse:
    return Ellipse(
        center_px=point2(d["center_px"]),
        major_px=number(d["major_px"]),
        minor_px=number(d["minor_px"]),
        angle_rad=number(d["angle_rad"]),
    )


def encode_window(window: DisparityWindow) -> Json:
    return {
        "x0": int(window.region.x0),
        "y0": int(window.region.y0),
        **packing.encode_disparity(window.disparity_px),
    }


def decode_window(d: Json) -> DisparityWindow:
    x0, y0, width, height = (whole(d[name]) for name in ("x0", "y0", "width", "height"))
    disparity_px = packing.decode_disparity(
        text(d["steps"]), width, height, number(d["lowest_px"]), number(d["steps_per_px"])
    )
    return DisparityWindow(Region(x0, y0, x0 + width, y0 + height), disparity_px)
