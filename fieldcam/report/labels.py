"""Where labels go: near what they name, over nothing else that matters.

Greedy: labels are placed one after the other, each where it costs least given
those before it. Costs are in pixels, so that a little more distance is taken
rather than an overlap.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldcam.report.ink import Point, Rect, point

_ANGLES = 24
_OVERLAP_COST = 4.0
"""For each pixel of side length by which a label covers something."""
_OUTSIDE_COST = 10_000.0
_CROSSING_COST = 400.0
_TURN_COST = 45.0
"""For pointing straight inwards instead of outwards."""

_Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Wish:
    """A label that wants a place."""

    anchor: Point
    """Centre of what is named."""
    radius_px: float
    """Half the size of what is named; the leader starts at its edge."""
    outwards: Point
    """Direction in which there is likely to be room; need not be of unit length."""
    width_px: float
    height_px: float
    reaches_px: tuple[float, ...]
    """Distances to try between the edge of what is named and the label."""


@dataclass(frozen=True, slots=True)
class PlacedLabel:
    """A label's rectangle and its leader line."""

    rect: Rect
    leader: tuple[Point, Point]


def place_labels(wishes: Sequence[Wish], frame: Rect, avoid: Sequence[Rect]) -> list[PlacedLabel]:
    """Places for all wishes, in their order, inside `frame` and clear of `avoid`."""
    taken = [(r.x0, r.y0, r.x1, r.y1) for r in avoid]
    placed: list[PlacedLabel] = []
    for wish in wishes:
        rects, starts, ends = _candidates(wish)
        cost = _shape_cost(wish, rects, starts, ends)
        cost += _OVERLAP_COST * _overlap_px(rects, np.array(taken).reshape(-1, 4))
        cost += _OUTSIDE_COST * _outside(rects, frame)
        for other in placed:
            cost += _CROSSING_COST * _crossings(starts, ends, other.leader)
        best = int(np.argmin(cost))
        rect = Rect(*rects[best])
        placed.append(PlacedLabel(rect, (point(starts[best]), point(ends[best]))))
        taken.append((rect.x0, rect.y0, rect.x1, rect.y1))
    return placed


def _candidates(wish: Wish) -> tuple[_Floats, _Floats, _Floats]:
    """(N, 4) rectangles, (N, 2) starts and (N, 2) ends of their leaders."""
    angles = np.linspace(0, 2 * math.pi, _ANGLES, endpoint=False)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    half = np.array([wish.width_px, wish.height_px]) / 2
    starts, ends, rects = [], [], []
    for reach in wish.reaches_px:
        start = np.array(wish.anchor) + directions * wish.radius_px
        end = start + directions * reach
        # The leader meets the label's near edge, so the label's centre lies half of
        # its own size further out.
        center = end + directions * half
        starts.append(start)
        ends.append(end)
        rects.append(np.hstack([center - half, center + half]))
    return np.vstack(rects), np.vstack(starts), np.vstack(ends)


def _shape_cost(wish: Wish, rects: _Floats, starts: _Floats, ends: _Floats) -> _Floats:
    """Short leaders that point outwards are best."""
    length = np.asarray(np.linalg.norm(ends - starts, axis=1), np.float64)
    outwards = np.array(wish.outwards, np.float64)
    norm = float(np.linalg.norm(outwards))
    if norm == 0:
        return length
    middle = (rects[:, :2] + rects[:, 2:]) / 2 - np.array(wish.anchor)
    cosine = (middle @ outwards) / (norm * np.linalg.norm(middle, axis=1))
    return np.asarray(length + _TURN_COST * (1 - cosine) / 2, np.float64)


def _overlap_px(rects: _Floats, taken: _Floats) -> _Floats:
    """(N,) sum over taken rectangles of the square root of the shared area."""
    low = np.maximum(rects[:, None, :2], taken[None, :, :2])
    high = np.minimum(rects[:, None, 2:], taken[None, :, 2:])
    shared = np.clip(high - low, 0, None).prod(axis=2)
    return np.asarray(np.sqrt(shared).sum(axis=1), np.float64)


def _outside(rects: _Floats, frame: Rect) -> _Floats:
    """(N,) 1 where a rectangle leaves the frame."""
    inside = (rects[:, :2] >= (frame.x0, frame.y0)).all(axis=1)
    inside &= (rects[:, 2:] <= (frame.x1, frame.y1)).all(axis=1)
    return np.asarray(~inside, np.float64)


def _crossings(starts: _Floats, ends: _Floats, other: tuple[Point, Point]) -> _Floats:
    """(N,) 1 where a leader crosses another one."""
    a, b = np.array(other[0]), np.array(other[1])
    one = _side(a, b, starts) * _side(a, b, ends) < 0
    two = _side(starts, ends, a) * _side(starts, ends, b) < 0
    return np.asarray(one & two, np.float64)


def _side(a: _Floats, b: _Floats, p: _Floats) -> _Floats:
    """Positive where p lies to one side of the line from a to b."""
    ab, ap = b - a, p - a
    return np.asarray(ab[..., 0] * ap[..., 1] - ab[..., 1] * ap[..., 0], np.float64)
