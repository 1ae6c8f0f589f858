"""One reading drawn over its left image: what was seen, what was sized, what to do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

import cv2
import numpy as np

from fieldcam.images.pixels import as_rgb
from fieldcam.report.ink import Canvas, Colour, Point, Rect, Typeface, circle
from fieldcam.report.labels import PlacedLabel, Wish, place_labels
from fieldcam.values import (
    ClusterReading,
    Flag,
    Fruitlet,
    ImageU8,
    ReasonCode,
    Status,
    TagPose,
)
from fieldcam.vision.sizing.outline import pixel_outline

# Okabe and Ito's palette: told apart with every common colour blindness.
TARGET: Colour = (255, 200, 40)
NEIGHBOURS: tuple[Colour, ...] = ((86, 180, 233), (204, 121, 167), (213, 94, 0), (0, 158, 115))
UNASSIGNED: Colour = (200, 200, 200)
INK: Colour = (16, 18, 22)
PAPER: Colour = (246, 246, 242)
MUTED: Colour = (176, 180, 186)
STATUS_COLOURS: dict[Status, Colour] = {
    Status.ACCEPT: (0, 158, 115),
    Status.CONFIRM: (230, 159, 0),
    Status.RETAKE: (213, 94, 0),
}
STATUS_INKS: dict[Status, Colour] = {
    Status.ACCEPT: PAPER,
    Status.CONFIRM: INK,
    Status.RETAKE: PAPER,
}

_DESIGN_WIDTH_PX = 1440
_SCALE_BAR_MM = 10.0


def draw_overlay(left: ImageU8, reading: ClusterReading, simulated: bool, footnote: str) -> ImageU8:
    """The picture for people; `left` is the rectified left image, (H, W, 3) or (H, W).

    `footnote` is the sentence about the networks, as `Models.honesty` gives it.
    """
    return _Overlay(left, reading).draw(simulated, footnote)


@dataclass(frozen=True, slots=True)
class _Look:
    """How one fruitlet is drawn."""

    fruitlet: Fruitlet
    colour: Colour
    zoom: float

    @property
    def outline(self) -> list[Point]:
        """Closed outline in canvas pixels; the mask's where the ellipse is known not to fit."""
        ellipse = self.fruitlet.outline
        fits = not {Flag.BAD_OUTLINE, Flag.OUTLIER} & set(self.fruitlet.flags)
        if ellipse is not None and (fits or self.fruitlet.mask.area_px == 0):
            return [_zoomed((x, y), self.zoom) for x, y in ellipse.points_px(72).tolist()]
        return [_zoomed((x, y), self.zoom) for x, y in pixel_outline(self.fruitlet.mask)]

    @property
    def center(self) -> Point:
        return _zoomed(self.fruitlet.center_px, self.zoom)

    @property
    def bounds(self) -> Rect:
        xs, ys = zip(*self.outline, strict=True)
        return Rect(min(xs), min(ys), max(xs), max(ys))


class _Overlay:
    """Draws the parts from back to front."""

    def __init__(self, left: ImageU8, reading: ClusterReading) -> None:
        rgb = as_rgb(left)
        self._zoom = max(1.0, _DESIGN_WIDTH_PX / rgb.shape[1])
        self._reading = reading
        self._canvas = Canvas(_enlarged(rgb, self._zoom))
        self._unit: float = self._canvas.image.shape[1] / _DESIGN_WIDTH_PX
        self._banner_px = 60 * self._unit
        self._footer_px = 30 * self._unit
        self._looks = [
            _Look(f, _colour(f, reading), self._zoom)
            for f in sorted(reading.fruitlets, key=lambda f: f.in_target)
            if f.mask.area_px or f.outline
        ]

    def draw(self, simulated: bool, footnote: str) -> ImageU8:
        """(H, W, 3), no narrower than what it is designed for."""
        self._dim_surroundings()
        for look in self._looks:
            self._paint_mask(look)
        for look in self._looks:
            self._paint_outline(look)
        self._paint_unsure()
        tag_rect = self._paint_tag()
        self._paint_labels([] if tag_rect is None else [tag_rect])
        self._paint_scale_bar()
        self._paint_banner()
        self._paint_footer(simulated, footnote)
        return self._canvas.image

    def _px(self, design_px: float) -> float:
        return design_px * self._unit

    def _face(self, size_px: float, bold: bool = False) -> Typeface:
        return Typeface(max(9, round(self._px(size_px))), bold)

    def _dim_surroundings(self) -> None:
        """Take light and colour from all but the target, with a soft edge."""
        target = [look for look in self._looks if look.fruitlet.in_target]
        if not target:
            return
        image = self._canvas.image
        spot = np.zeros(image.shape[:2], np.uint8)
        points = np.rint([p for look in target for p in look.outline]).astype(np.int32)
        cv2.fillConvexPoly(spot, cv2.convexHull(points.reshape(-1, 1, 2)), 255)
        # A quarter of the size is enough for so wide a blur, and 16 times faster.
        small = cv2.resize(spot, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
        reach = max(1, round(self._px(9)))
        small = cv2.dilate(small, np.ones((reach, reach), np.uint8))
        small = cv2.GaussianBlur(small, (0, 0), self._px(9))
        weight = cv2.resize(small, image.shape[1::-1]).astype(np.float32)[..., None] / 255
        grey = image.mean(axis=2, keepdims=True, dtype=np.float32)
        dimmed = (0.6 * image + 0.4 * grey) * 0.6
        image[:] = np.rint(weight * image + (1 - weight) * dimmed).astype(np.uint8)

    def _paint_mask(self, look: _Look) -> None:
        mask = look.fruitlet.mask
        if mask.area_px == 0:
            return
        padded = np.pad(mask.window.astype(np.uint8) * 255, 2)
        soft = cv2.GaussianBlur(_enlarged(padded, self._zoom), (0, 0), 0.8 * self._zoom)
        corner = (round((mask.x0 - 2) * self._zoom), round((mask.y0 - 2) * self._zoom))
        alpha = 0.3 if look.fruitlet.in_target else 0.22
        self._canvas.tint(*corner, np.asarray(soft, np.uint8), look.colour, alpha)

    def _paint_outline(self, look: _Look) -> None:
        outline = look.outline
        if look.fruitlet.diameter_mm is None:
            for dash in _dashes(outline, self._px(6)):
                self._canvas.polyline(dash, look.colour, self._px(1.4), alpha=0.9)
            return
        if not look.fruitlet.in_target:
            self._canvas.polyline(outline, look.colour, self._px(1), alpha=0.8, closed=True)
            return
        self._canvas.polyline(outline, INK, self._px(4), alpha=0.35, closed=True)
        self._canvas.polyline(outline, look.colour, self._px(2), closed=True)

    def _paint_unsure(self) -> None:
        """A ring with a question mark where the verdict asks whether there is fruit."""
        if all(r.code is not ReasonCode.UNSURE_FRUIT for r in self._reading.verdict.reasons):
            return
        face, radius = self._face(17, bold=True), self._px(13)
        for place in self._reading.unsure_px:
            x, y = _zoomed(place, self._zoom)
            ring = circle((x, y), radius)
            self._canvas.polyline(ring, INK, self._px(4), alpha=0.4, closed=True)
            self._canvas.polyline(ring, PAPER, self._px(1.6), closed=True)
            self._chip(Rect(x - radius, y - radius, x + radius, y + radius), "?", face, PAPER, 0.0)

    def _paint_tag(self) -> Rect | None:
        """Outline the tag; gives the rectangle that it takes with its name."""
        tag = self._reading.tag
        if tag is None:
            return None
        corners = [_zoomed(p, self._zoom) for p in tag.corners_px]
        self._canvas.polyline(corners, INK, self._px(5), alpha=0.4, closed=True)
        self._canvas.polyline(corners, PAPER, self._px(2), closed=True)
        xs, ys = zip(*corners, strict=True)
        name, face = _tag_name(tag), self._face(17, bold=True)
        chip = Rect(0, 0, face.width_px(name) + self._px(18), self._px(27))
        x = min(max(min(xs), self._px(8)), self._canvas.bounds.x1 - chip.x1 - self._px(8))
        y = min(max(ys) + self._px(7), self._canvas.bounds.y1 - self._footer_px - chip.y1)
        placed = Rect(x, y, x + chip.x1, y + chip.y1)
        self._chip(placed, name, face, PAPER, 0.78)
        return Rect(min(min(xs), x), min(ys), max(max(xs), placed.x1), placed.y1)

    def _paint_labels(self, avoid: Sequence[Rect]) -> None:
        target = [look for look in self._looks if look.fruitlet.in_target]
        others = [look for look in self._looks if not look.fruitlet.in_target]
        bounds, edge = self._canvas.bounds, self._px(8)
        frame = Rect(
            edge, self._banner_px + edge, bounds.x1 - edge, bounds.y1 - self._footer_px - edge
        )
        # Neighbours are small print: they give way to the target's labels.
        fruits = [look.bounds for look in self._looks]
        wishes = [self._wish(look, _middle(target), 21, (14, 26, 42, 62, 90)) for look in target]
        wishes += [self._wish(look, look.center, 14, (3, 14, 30)) for look in others]
        places = place_labels(wishes, frame, [*avoid, *fruits])
        for look, place in zip([*target, *others], places, strict=True):
            self._paint_label(look, place)

    def _wish(self, look: _Look, middle: Point, size_px: float, reaches: Iterable[float]) -> Wish:
        text, face = _label(look.fruitlet), self._face(size_px, bold=look.fruitlet.in_target)
        bounds, center = look.bounds, look.center
        return Wish(
            anchor=center,
            radius_px=max(bounds.x1 - bounds.x0, bounds.y1 - bounds.y0) / 2,
            outwards=(center[0] - middle[0], center[1] - middle[1]),
            width_px=face.width_px(text) + self._px(18 if look.fruitlet.in_target else 8),
            height_px=self._px(size_px * 1.5),
            reaches_px=tuple(self._px(r) for r in reaches),
        )

    def _paint_label(self, look: _Look, place: PlacedLabel) -> None:
        text = _label(look.fruitlet)
        if not look.fruitlet.in_target:
            self._chip(place.rect, text, self._face(14), look.colour, 0.35)
            return
        start, end = place.leader
        self._canvas.polyline([start, end], INK, self._px(3.4), alpha=0.35)
        self._canvas.polyline([start, end], look.colour, self._px(1.4))
        self._canvas.dot(start, self._px(3), look.colour)
        sized = look.fruitlet.diameter_mm is not None
        self._chip(
            place.rect, text, self._face(21, bold=True), look.colour if sized else MUTED, 0.8
        )  # fmt: skip

    def _chip(self, rect: Rect, text: str, face: Typeface, colour: Colour, alpha: float) -> None:
        """Text on a rounded dark plate."""
        self._canvas.panel(rect, INK, alpha, self._px(6))
        x, y = rect.center
        at = (x - face.width_px(text) / 2, y + face.cap_height_px / 2)
        self._canvas.text(at, text, face, colour)

    def _paint_scale_bar(self) -> None:
        range_mm = _target_range_mm(self._reading)
        if range_mm is None:
            return
        length = self._reading.calibration.px_per_mm(range_mm) * _SCALE_BAR_MM * self._zoom
        text = f"10 mm at {range_mm:.0f} mm"
        face, pad = self._face(15), self._px(12)
        x0, y1 = self._px(16), self._canvas.bounds.y1 - self._footer_px - self._px(14)
        width = max(length, face.width_px(text)) + 2 * pad
        self._canvas.panel(Rect(x0, y1 - self._px(48), x0 + width, y1), INK, 0.62, self._px(6))
        self._canvas.text((x0 + pad, y1 - self._px(27)), text, face, PAPER)
        y, tick = y1 - self._px(13), self._px(5)
        ends = [(x0 + pad, y), (x0 + pad + length, y)]
        self._canvas.polyline(ends, PAPER, self._px(2))
        for x, _ in ends:
            self._canvas.polyline([(x, y - tick), (x, y + tick)], PAPER, self._px(2))

    def _paint_banner(self) -> None:
        bounds, verdict = self._canvas.bounds, self._reading.verdict
        self._canvas.panel(Rect(0, 0, bounds.x1, self._banner_px), INK, 0.82)
        face, pad = self._face(24, bold=True), self._px(14)
        word = verdict.status.upper()
        pill = Rect(
            pad, self._px(11), pad + face.width_px(word) + 2 * pad, self._banner_px - self._px(11)
        )
        self._canvas.panel(pill, STATUS_COLOURS[verdict.status], 1.0, self._px(8))
        baseline = self._banner_px / 2 + face.cap_height_px / 2
        self._canvas.text((pill.x0 + pad, baseline), word, face, STATUS_INKS[verdict.status])
        counts, small = _counts(self._reading), self._face(19)
        right = bounds.x1 - pad - small.width_px(counts)
        self._canvas.text((right, baseline), counts, small, MUTED)
        reasons = "   ".join(reason.text for reason in verdict.reasons)
        room = right - pill.x1 - 2 * self._px(18)
        self._canvas.text(
            (pill.x1 + self._px(18), baseline), _shortened(reasons, small, room), small, PAPER
        )  # fmt: skip

    def _paint_footer(self, simulated: bool, footnote: str) -> None:
        bounds = self._canvas.bounds
        top, pad, face = bounds.y1 - self._footer_px, self._px(14), self._face(14)
        self._canvas.panel(Rect(0, top, bounds.x1, bounds.y1), INK, 0.82)
        baseline = top + self._footer_px / 2 + face.cap_height_px / 2
        note = f"Simulated picture.  {footnote}" if simulated else footnote
        settings = self._reading.settings
        made = f"method {settings.method}, stereo {settings.stereo}"
        if self._reading.software_version:
            made += f", fieldcam {self._reading.software_version}"
        right = bounds.x1 - pad - face.width_px(made)
        self._canvas.text((right, baseline), made, face, MUTED)
        self._canvas.text((pad, baseline), _shortened(note, face, right - 2 * pad), face, PAPER)


def _enlarged(image: ImageU8, zoom: float) -> ImageU8:
    if zoom == 1.0:
        return image.copy()
    size = (round(image.shape[1] * zoom), round(image.shape[0] * zoom))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_CUBIC), np.uint8)


def _zoomed(point: Point, zoom: float) -> Point:
    """Canvas position of an image position; pixel centres stay pixel centres."""
    return (point[0] + 0.5) * zoom - 0.5, (point[1] + 0.5) * zoom - 0.5


def _colour(fruitlet: Fruitlet, reading: ClusterReading) -> Colour:
    if fruitlet.in_target:
        return TARGET
    if fruitlet.cluster is None:
        return UNASSIGNED
    neighbours = sorted(
        {f.cluster for f in reading.fruitlets if not f.in_target and f.cluster is not None}
    )
    return NEIGHBOURS[neighbours.index(fruitlet.cluster) % len(NEIGHBOURS)]


def _dashes(outline: Sequence[Point], length_px: float) -> list[list[Point]]:
    """Every second piece of about this length of a closed line."""
    closed = np.array([*outline, outline[0]])
    walked = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    pieces = max(4, 2 * round(walked[-1] / (2 * length_px)))
    edges = np.linspace(0, walked[-1], pieces + 1)
    return [
        [
            (float(np.interp(s, walked, closed[:, 0])), float(np.interp(s, walked, closed[:, 1])))
            for s in np.linspace(start, end, 5)
        ]
        for start, end in zip(edges[::2], edges[1::2], strict=False)
    ]


def _middle(looks: Sequence[_Look]) -> Point:
    if not looks:
        return 0.0, 0.0
    xs, ys = zip(*(look.center for look in looks), strict=True)
    return sum(xs) / len(xs), sum(ys) / len(ys)


def _label(fruitlet: Fruitlet) -> str:
    if fruitlet.diameter_mm is not None:
        return (
            f"{fruitlet.diameter_mm:.1f} mm"
            if fruitlet.in_target
            else f"{fruitlet.diameter_mm:.1f}"
        )
    return ", ".join(str(flag).replace("_", " ") for flag in fruitlet.flags) or "not sized"


def _tag_name(tag: TagPose) -> str:
    return f"tag {tag.id}" if tag.range_mm is None else f"tag {tag.id}  ·  {tag.range_mm:.0f} mm"


def _target_range_mm(reading: ClusterReading) -> float | None:
    ranges = [f.range_mm for f in reading.target if f.range_mm is not None]
    if ranges:
        return median(ranges)
    return None if reading.tag is None else reading.tag.range_mm


def _counts(reading: ClusterReading) -> str:
    target = reading.target
    sized = sum(f.diameter_mm is not None for f in target)
    text = f"{sized} of {len(target)} sized"
    expected = reading.expectation.fruitlets
    return text if expected is None else f"{text},  {expected} last visit"


def _shortened(text: str, face: Typeface, room_px: float) -> str:
    """The text, cut with an ellipsis where it does not fit."""
    if face.width_px(text) <= room_px:
        return text
    while text and face.width_px(text + "…") > room_px:
        text = text[:-1]
    return text.rstrip() + "…" if text else ""
