"""What a calibration rests on, in one picture.

Above, where either eye saw corners of the board; below, how the board was tilted, how far
away it was, and how well each view fits.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcam.calibration.boards import Pixels
from fieldcam.calibration.calibrating import Calibrated, ViewReport
from fieldcam.calibration.coverage import COLUMN_EDGES, FAR_MM, NEAR_MM, ROW_EDGES
from fieldcam.report.ink import Canvas, Colour, Point, Rect, Typeface, circle
from fieldcam.values import FARTHEST_MM, NEAREST_MM, ImageU8

WIDTH_PX = 1200
MARGIN_PX, TITLE_PX, LOWER_PX = 30, 40, 250
PAPER: Colour = (250, 250, 248)
INK: Colour = (30, 34, 40)
FAINT: Colour = (200, 204, 208)
UNSEEN: Colour = (247, 222, 206)
# Okabe and Ito's palette: told apart with every common colour blindness.
KEPT: Colour = (0, 114, 178)
DROPPED: Colour = (213, 94, 0)
TEXT, SMALL = Typeface(17), Typeface(14)
STEEPEST_DEG = 60.0
SHOWN_MM = (NEAREST_MM - 100.0, FARTHEST_MM + 200.0)
BAR_PX = 9
TALLEST_BAR = 2.0
"""In limits, so that one bad view does not flatten all others."""


def draw_coverage(result: Calibrated) -> ImageU8:
    """RGB (H, W, 3)."""
    width, height = result.rig.size_px
    panel_px = (WIDTH_PX - 3 * MARGIN_PX) / 2
    tall_px = panel_px * height / width
    rows = round(TITLE_PX + tall_px + LOWER_PX + 2 * MARGIN_PX)
    canvas = Canvas(np.full((rows, WIDTH_PX, 3), PAPER, np.uint8))
    for i, eye in enumerate(("left", "right")):
        x0 = MARGIN_PX + i * (panel_px + MARGIN_PX)
        panel = Rect(x0, TITLE_PX, x0 + panel_px, TITLE_PX + tall_px)
        _draw_eye(canvas, panel, result, eye)
    top = TITLE_PX + tall_px + 2 * MARGIN_PX
    box = [Rect(x0, top, x1, rows - 30) for x0, x1 in ((30, 250), (310, 610), (670, 1170))]
    _draw_tilts(canvas, box[0], result.views)
    _draw_distances(canvas, box[1], result.views)
    _draw_residuals(canvas, box[2], result.views)
    return canvas.image


def _draw_eye(canvas: Canvas, panel: Rect, result: Calibrated, eye: str) -> None:
    title = f"{eye} eye: corners of {len(result.kept)} views"
    canvas.text((panel.x0, panel.y0 - 12), title, TEXT, INK)
    unseen = {cell[1:] for cell in result.coverage.missing_cells if cell.eye == eye}
    xs = [panel.x0 + edge * (panel.x1 - panel.x0) for edge in COLUMN_EDGES]
    ys = [panel.y0 + edge * (panel.y1 - panel.y0) for edge in ROW_EDGES]
    for row, column in np.ndindex(len(ys) - 1, len(xs) - 1):
        cell = Rect(xs[column], ys[row], xs[column + 1], ys[row + 1])
        if (row, column) in unseen:
            canvas.panel(cell, UNSEEN, 1.0)
        _outline(canvas, cell)
    scale = (panel.x1 - panel.x0) / result.rig.size_px[0]
    for view in result.views:
        places = view.judged.view.left_px if eye == "left" else view.judged.view.right_px
        for at in _moved(places, panel, scale):
            canvas.dot(at, 2.2, _colour(view), 0.8)


def _moved(places_px: Pixels, panel: Rect, scale: float) -> list[Point]:
    return [(panel.x0 + (x + 0.5) * scale, panel.y0 + (y + 0.5) * scale) for x, y in places_px]


def _draw_tilts(canvas: Canvas, box: Rect, views: Sequence[ViewReport]) -> None:
    """The middle is a board held flat; upwards, its upper edge is nearer."""
    canvas.text((box.x0, box.y0 - 12), "tilts", TEXT, INK)
    x, y = box.center
    radius_px = min(box.x1 - box.x0, box.y1 - box.y0) / 2
    for degrees in (20.0, 40.0, STEEPEST_DEG):
        r = radius_px * degrees / STEEPEST_DEG
        canvas.polyline(circle((x, y), r, 71), FAINT, 1.0, closed=True)
        canvas.text((x + 3, y - r + 14), f"{degrees:.0f}°", SMALL, INK)
    for view in views:
        pose = view.judged.pose
        way = -pose.normal[:2] / max(float(np.linalg.norm(pose.normal[:2])), 1e-9)
        r = radius_px * min(pose.tilt_deg / STEEPEST_DEG, 1.0)
        canvas.dot((x + r * way[0], y + r * way[1]), 4.0, _colour(view), 0.9)


def _draw_distances(canvas: Canvas, box: Rect, views: Sequence[ViewReport]) -> None:
    canvas.text((box.x0, box.y0 - 12), "distances, mm", TEXT, INK)
    y = box.center[1]

    def at(range_mm: float) -> float:
        share = (range_mm - SHOWN_MM[0]) / (SHOWN_MM[1] - SHOWN_MM[0])
        return box.x0 + (box.x1 - box.x0) * min(max(share, 0.0), 1.0)

    for mark in (NEAREST_MM, NEAR_MM, FAR_MM, FARTHEST_MM):
        canvas.polyline([(at(mark), y - 60), (at(mark), y + 60)], FAINT, 1.0)
        canvas.text((at(mark) - 12, y + 80), f"{mark:.0f}", SMALL, INK)
    for i, view in enumerate(views):
        # Side by side, so that views from one distance are told apart.
        lift = (i % 7 - 3) * 14
        canvas.dot((at(view.judged.pose.range_mm), y + lift), 4.0, _colour(view), 0.9)


def _draw_residuals(canvas: Canvas, box: Rect, views: Sequence[ViewReport]) -> None:
    """One bar a view, in the order of their names; what is cut off has no cap."""
    limit_px = max(each.judged.worst_px for each in views if not each.judged.why_dropped)
    title = f"residuals by view; the longest that counts is {limit_px:.2f} px"
    canvas.text((box.x0, box.y0 - 12), title, TEXT, INK)
    step = min(2.0 * BAR_PX, (box.x1 - box.x0) / len(views))
    for i, view in enumerate(views):
        tall = min(view.judged.worst_px / limit_px, TALLEST_BAR) / TALLEST_BAR
        x0 = box.x0 + i * step
        bar = Rect(x0, box.y1 - tall * (box.y1 - box.y0), x0 + step / 2, box.y1)
        canvas.panel(bar, _colour(view), 1.0)
    canvas.text((box.x0, box.y1 + 18), "used", SMALL, KEPT)
    canvas.text((box.x0 + 50, box.y1 + 18), "dropped", SMALL, DROPPED)


def _colour(view: ViewReport) -> Colour:
    return DROPPED if view.judged.why_dropped else KEPT


def _outline(canvas: Canvas, rect: Rect) -> None:
    corners = [(rect.x0, rect.y0), (rect.x1, rect.y0), (rect.x1, rect.y1), (rect.x0, rect.y1)]
    canvas.polyline(corners, FAINT, 1.0, closed=True)
