"""Which lenses can be rectified: those of OpenCV's pinhole model, by the names they go by."""

from __future__ import annotations

from fieldcam.calibration.reading.documents import Array, CalibrationDocument

NAMED_UNDER = ("camera_model", "distortion_model", "distortion_type", "lens_model", "model_type")
FLAGGED_UNDER = ("fisheye", "fisheye_model", "is_fisheye")
PINHOLE = frozenset(
    {
        "pinhole",
        "perspective",
        "plumb_bob",
        "rational_polynomial",
        "radtan",
        "brown_conrady",
        "thin_prism",
        "none",
    }
)
FISHEYE = frozenset({"fisheye", "equidistant", "equi", "kannala_brandt", "kb4", "opencv_fisheye"})
OTHERS = FISHEYE | {
    "omni", "omnidirectional", "omnidir", "mei", "ucm", "eucm", "ds", "double_sphere", "fov",
    "ftheta", "f_theta", "stereographic", "equisolid", "ocam", "scaramuzza", "spherical",
    "equirectangular", "panoramic",
}  # fmt: skip
"""Models that programs name under any key."""
NOT_SET = ("", "0", "0.0", "false", "no")
EITHER = 4
"""Coefficients that a pinhole model and OpenCV's fisheye model both have."""
HINT = (
    "Rectify its pictures with the program that calibrated it, and give the right eye's"
    " CameraInfo of the rectified ones."
)


def check_lens(document: CalibrationDocument, distortion: Array) -> None:
    """Refuses distortion (N,) whose model is another one, or is not said where it could be two."""
    said = [name for name in NAMED_UNDER if document.text(name)]
    for name in said:
        model = _plain(document.text(name))
        if model in FISHEYE:
            raise document.refuse(
                f"is of a fisheye lens ({name}: {document.text(name)}), which cannot be used raw.",
                HINT,
            )
        if model not in PINHOLE:
            raise document.refuse(
                f"is of a lens that is not known ({name}: {document.text(name)[:40]}).", HINT
            )
    for name in FLAGGED_UNDER:
        if document.text(name).lower() not in NOT_SET:
            raise document.refuse(f"is of a fisheye lens ({name}), which cannot be used raw.", HINT)
    for name, entry in document.entries.items():
        if isinstance(entry, str) and _plain(entry) in OTHERS:
            raise document.refuse(f"is of another lens than a pinhole ({name}: {entry}).", HINT)
    if not said and distortion.size == EITHER and distortion.any():
        raise document.refuse(
            "has four distortion coefficients and does not say of which model: a pinhole"
            " lens and a fisheye lens both have four.",
            "If the lens is no fisheye, add the line `distortion_model: plumb_bob`.",
        )


def _plain(model: str) -> str:
    """As the names above are written."""
    return "_".join(model.lower().replace("-", " ").split())
