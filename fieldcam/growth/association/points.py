"""A picture's target cluster as points in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldcam.growth.places import Place, SeenFruitlet, View
from fieldcam.values import Calibration, Fruitlet

F64 = npt.NDArray[np.float64]

SURFACE_SHARE = 0.7
"""Half of a sphere's visible surface lies more than this share of its radius before its middle."""
UNSIZED_RADIUS_MM = 4.0
"""Where no size is known: of a fruitlet of the usual first visit."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """The fruitlets of one picture's target cluster."""

    seen: tuple[SeenFruitlet, ...]
    tag_mm: F64 | None
    """(3,) middle of the tag in the camera frame; None where it was not measured."""
    tag_rotation: F64 | None
    """(3, 3) from tag to camera frame."""

    @property
    def centers_mm(self) -> F64:
        """(N, 3)"""
        return np.array([s.center_mm for s in self.seen], np.float64).reshape(-1, 3)

    @property
    def diameters_mm(self) -> F64:
        """(N,) NaN where a fruitlet has no size."""
        return _or_nan([s.diameter_mm for s in self.seen])

    @property
    def sds_mm(self) -> F64:
        """(N,) standard deviations of the sizes, NaN where unknown."""
        return _or_nan([s.sd_mm for s in self.seen])


def _or_nan(values: Sequence[float | None]) -> F64:
    return np.array([np.nan if value is None else value for value in values], np.float64)


def points_of(view: View) -> Points:
    """The fruitlets that count in a picture, with the operator's corrections applied."""
    reading = view.reading
    seen = tuple(_seen(view.id, f, reading.calibration) for f in counted(view))
    tag = reading.tag
    placed = tag is not None and tag.translation_mm is not None
    turned = tag is not None and tag.rotation is not None
    return Points(
        tuple(s for s in seen if s is not None),
        np.array(tag.translation_mm) if tag is not None and placed else None,
        np.array(tag.rotation) if tag is not None and turned else None,
    )


def counted(view: View) -> Sequence[Fruitlet]:
    """Fruitlets of the target cluster that the operator did not strike out."""
    chosen = (
        view.reading.target
        if view.cluster is None
        else [f for f in view.reading.fruitlets if f.cluster == view.cluster]
    )
    return [f for f in chosen if f.id not in view.struck_out]


def _seen(reading: str, fruitlet: Fruitlet, calibration: Calibration) -> SeenFruitlet | None:
    center = _center_mm(fruitlet, calibration)
    if center is None:
        return None
    return SeenFruitlet(
        Place(reading, fruitlet.id),
        fruitlet.diameter_mm,
        fruitlet.sd_mm,
        center,
        fruitlet.cloud_mm,
    )


def _center_mm(fruitlet: Fruitlet, calibration: Calibration) -> tuple[float, float, float] | None:
    """On the line of sight through the outline's centre, behind the visible surface."""
    if fruitlet.range_mm is None:
        return None
    radius_mm = UNSIZED_RADIUS_MM if fruitlet.diameter_mm is None else fruitlet.diameter_mm / 2
    z = fruitlet.range_mm + SURFACE_SHARE * radius_mm
    x = (fruitlet.center_px[0] - calibration.cx_px) / calibration.focal_px * z
    y = (fruitlet.center_px[1] - calibration.cy_px) / calibration.focal_px * z
    return x, y, z
