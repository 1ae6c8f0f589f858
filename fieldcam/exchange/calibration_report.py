"""The document that `fieldcam calibrate --json` prints and `report.json` holds."""

from __future__ import annotations

import numpy as np

from fieldcam.calibration.boards import Board
from fieldcam.calibration.calibrating import Calibrated, ViewReport
from fieldcam.calibration.coverage import Coverage
from fieldcam.calibration.solving import Lens
from fieldcam.exchange.json_form import Json
from fieldcam.exchange.rounding import each_rounded

SCHEMA_VERSION = 1


def calibration_report(result: Calibrated) -> Json:
    """The calibration and its evidence, rounded to what means something.

    `left` and `right` are the lenses as they are, `rectified` is the camera that they
    make; residuals are root mean squares in raw pixels, `rows_px` in rectified ones.
    """
    camera = result.rig.rectified
    return {
        "schema": SCHEMA_VERSION,
        "board": board_report(result.board),
        "size_px": list(result.rig.size_px),
        "baseline_mm": round(result.camera.baseline_mm, 4),
        "rectified": {
            "focal_px": round(camera.focal_px, 3),
            "cx_px": round(camera.cx_px, 3),
            "cy_px": round(camera.cy_px, 3),
        },
        "left": _lens_report(result.camera.left),
        "right": _lens_report(result.camera.right),
        "rotation": each_rounded(np.ravel(result.camera.rotation), 9),
        "translation_mm": each_rounded(np.ravel(result.camera.translation_mm), 4),
        "rms_px": round(result.rms_px, 4),
        "rows_px": round(result.rows_px, 4),
        "views": [_view_report(view) for view in result.views],
        "unseen": [{"name": each.name, "why": each.why} for each in result.unseen],
        "coverage": _coverage_report(result.coverage),
        "warnings": list(result.warnings),
    }


def board_report(board: Board) -> Json:
    """The board as the command line names it."""
    squares = {"columns": board.columns, "rows": board.rows, "square_mm": board.square_mm}
    return {"kind": board.kind.value, **squares}


def _lens_report(lens: Lens) -> Json:
    matrix = lens.camera_matrix
    return {
        "fx_px": round(float(matrix[0, 0]), 3),
        "fy_px": round(float(matrix[1, 1]), 3),
        "cx_px": round(float(matrix[0, 2]), 3),
        "cy_px": round(float(matrix[1, 2]), 3),
        "distortion": each_rounded(np.ravel(lens.distortion), 6),
        "focal_sigma_px": round(lens.focal_sigma_px, 3),
    }


def _view_report(view: ViewReport) -> Json:
    judged = view.judged
    return {
        "name": judged.view.name,
        "used": not judged.why_dropped,
        "why_dropped": judged.why_dropped,
        "corners": len(judged.view.board_mm),
        "left_rms_px": round(judged.left_rms_px, 4),
        "right_rms_px": round(judged.right_rms_px, 4),
        "rows_px": round(view.rows_px, 4),
        "range_mm": round(judged.pose.range_mm, 1),
        "tilt_deg": round(judged.pose.tilt_deg, 1),
    }


def _coverage_report(coverage: Coverage) -> Json:
    return {
        "left_corners": coverage.left.tolist(),
        "right_corners": coverage.right.tolist(),
        "tilts": sorted(tilt.value for tilt in coverage.tilts),
        "range_mm": [round(coverage.nearest_mm, 1), round(coverage.farthest_mm, 1)],
        "missing": list(coverage.missing_words),
    }
