"""Kalibr's camchain: two cameras as OpenCV's programs would name their numbers."""

from __future__ import annotations

from fieldcam.calibration.reading.documents import Array, CalibrationDocument
from fieldcam.calibration.reading.lens_models import check_lens

EYES = ("cam0", "cam1")
FROM_FIRST = "T_cn_cnm1"
"""Carries a point from the first camera's frame to this one's; metres."""


def is_kalibr(document: CalibrationDocument) -> bool:
    first = document.entries.get(EYES[0])
    return isinstance(first, dict) and "intrinsics" in first


def spelt_out(document: CalibrationDocument) -> CalibrationDocument:
    """The same camera with M1, D1, M2, D2, R and T; raises CalibrationInvalid."""
    if EYES[1] not in document.entries:
        raise document.refuse("describes one camera only.", "Calibrate both eyes together.")
    if "cam2" in document.entries:
        raise document.refuse("describes more than two cameras.", "Leave cam0 and cam1 in it.")
    left, right = (document.part(eye) for eye in EYES)
    if left.size_px() != right.size_px():
        raise document.refuse("gives its two cameras different image sizes.")
    pose = right.matrix((4, 4), FROM_FIRST)
    entries: dict[str, object] = {
        "units": "m",
        "image_size": left.entry("resolution"),
        "R": _texts(pose[:3, :3]),
        "T": _texts(pose[:3, 3]),
    }
    for number, eye in zip("12", (left, right), strict=True):
        check_lens(eye, eye.numbers("distortion_coeffs"))
        fx, fy, cx, cy = eye.matrix((4,), "intrinsics")
        entries[f"M{number}"] = [str(v) for v in (fx, 0, cx, 0, fy, cy, 0, 0, 1)]
        entries[f"D{number}"] = eye.entry("distortion_coeffs")
    entries["distortion_model"] = right.entry("distortion_model")
    return CalibrationDocument(document.path, entries)


def _texts(values: Array) -> list[str]:
    return [repr(float(value)) for value in values.ravel()]
