"""Diameters: the paper's formula, and a better one (paper section III-F).

A fruitlet is taken as slightly prolate, so the short axis of its silhouette is
its equatorial diameter from every side.

The better one fits the fruitlet's own edges only, to a fraction of a pixel, and
puts the fruitlet where its centre is (`surface`). What cannot be measured well
gets a flag instead of a size.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import (
    BoolMask,
    Calibration,
    DisparityWindow,
    Ellipse,
    Flag,
    Instance,
)
from fieldcam.vision.sizing.ellipse import EllipseFit, fit_ellipse
from fieldcam.vision.sizing.outline import (
    Cover,
    Outline,
    hidden_arc,
    pixel_outline,
    true_edge,
    zero_outline,
)
from fieldcam.vision.sizing.parameters import Corrections, SizingParameters
from fieldcam.vision.sizing.surface import Surface, diameter_and_spread

Vectors = npt.NDArray[np.float64]
NO_POINTS: Vectors = np.zeros((0, 2))


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One instance and what is known about it apart from its mask."""

    instance: Instance
    window: DisparityWindow
    known: BoolMask
    """Over the mask's window: pixels whose disparity is trusted."""
    cover: Cover | None
    is_cut: bool
    """Whether the mask runs into the border of the searched region."""


@dataclass(frozen=True, slots=True, eq=False)
class SizedOutline:
    """What sizing says about one fruitlet."""

    diameter_mm: float | None
    sd_mm: float | None
    """Standard deviation of the diameter; None where none could be measured."""
    outline: Ellipse | None
    disparity_px: float | None
    """Median over the visible surface."""
    visible_fraction: float
    flags: tuple[Flag, ...]


def size_fruitlet(
    observed: Observation,
    calibration: Calibration,
    parameters: SizingParameters | None = None,
    corrections: Corrections | None = None,
) -> SizedOutline:
    """The default method."""
    parameters = parameters or SizingParameters()
    corrections = corrections or Corrections()
    surface = Surface.of(observed.instance.visible, observed.known, observed.window)
    median = surface.median_px
    early = _early_flags(observed, median)
    fit = _fit(observed, parameters, corrections)
    if fit is None:
        return SizedOutline(None, None, None, median, 1.0, (*early, Flag.BAD_OUTLINE))
    ellipse = fit.ellipse
    visible = _visible_fraction(observed.instance, ellipse.area_px)
    flags = (*early, *_outline_flags(fit, visible, parameters))
    if observed.instance.score < parameters.min_score:
        flags = (*flags, Flag.BAD_OUTLINE)
    if median is None:
        return SizedOutline(None, None, ellipse, None, visible, _unique(flags))
    diameter, spread = diameter_and_spread(fit, surface, calibration, corrections)
    outline_sd = fit.minor_sd_px * calibration.baseline_mm / median
    sd = parameters.uncertainty.sd_mm(diameter, outline_sd, observed.instance.width_sd)
    flags = _unique((*flags, *_value_flags(diameter, sd, spread, parameters)))
    return SizedOutline(None if flags else diameter, sd, ellipse, median, visible, flags)


def _visible_fraction(instance: Instance, outline_area_px: float) -> float:
    """As the network takes it, else the mask's share of the fitted outline.

    What hides a fruitlet without leaving a dent in its outline is not in the outline's area.
    """
    of_outline = instance.visible.area_px / outline_area_px
    seen = 1.0 if instance.seen_fraction is None else instance.seen_fraction
    return float(np.clip(min(of_outline, seen), 0.0, 1.0))


def size_by_paper(observed: Observation, calibration: Calibration) -> SizedOutline:
    """The paper's formula: pixel contour, fitEllipse, baseline * minor / median disparity."""
    points = pixel_outline(observed.instance.visible)
    surface = Surface.of(observed.instance.visible, observed.known, observed.window)
    median = surface.median_px
    if len(points) < 5:
        return SizedOutline(None, None, None, median, 1.0, (Flag.BAD_OUTLINE,))
    ellipse = _opencv_ellipse(points)
    if median is None:
        return SizedOutline(None, None, ellipse, None, 1.0, (Flag.NO_DEPTH,))
    diameter = calibration.baseline_mm * ellipse.minor_px / median
    return SizedOutline(diameter, None, ellipse, median, 1.0, ())


def _fit(
    observed: Observation, parameters: SizingParameters, corrections: Corrections
) -> EllipseFit | None:
    instance = observed.instance
    mask = instance.visible
    outline = zero_outline(instance.visible_logits, mask.x0, mask.y0)
    hidden = NO_POINTS
    own = np.ones(len(outline.points_px), dtype=np.bool_)
    if corrections.own_edge:
        own = true_edge(outline, instance, observed.cover, instance.whole_logits)
        if instance.whole_logits is not None:
            silhouette = zero_outline(instance.whole_logits, mask.x0, mask.y0)
            hidden = hidden_arc(outline, silhouette)
    points = outline.points_px - parameters.edge_bias_px * outline.outward
    if not corrections.subpixel:
        points = pixel_outline(mask)
        own = _as_nearest(points, outline, own)
    if corrections.robust:
        return fit_ellipse(points[own], hidden, parameters.fit)
    return _plain_fit(points[own])


def _as_nearest(points: Vectors, outline: Outline, own: BoolMask) -> BoolMask:
    """For each of some points, what holds for the nearest outline point."""
    if len(points) == 0 or len(own) == 0:
        return np.zeros(len(points), dtype=np.bool_)
    gaps = ((points[:, None] - outline.points_px[None]) ** 2).sum(axis=2)
    return np.asarray(own[gaps.argmin(axis=1)], dtype=np.bool_)


def _plain_fit(points: Vectors) -> EllipseFit | None:
    if len(points) < 6:
        return None
    ellipse = _opencv_ellipse(points)
    if ellipse.minor_px < 1.0:
        return None
    along = np.array([np.cos(ellipse.angle_rad), np.sin(ellipse.angle_rad)])
    across = np.array([-along[1], along[0]])
    shape = 2 / ellipse.major_px * np.outer(along, along)
    shape += 2 / ellipse.minor_px * np.outer(across, across)
    return EllipseFit(ellipse.center_px, shape, 0.0, 0.0, 1.0)


def _opencv_ellipse(points: Vectors) -> Ellipse:
    (x, y), (width, height), degrees = cv2.fitEllipse(points.astype(np.float32))
    angle = np.deg2rad(degrees if width >= height else degrees + 90.0)
    return Ellipse((float(x), float(y)), max(width, height), min(width, height), float(angle))


def _early_flags(observed: Observation, median: float | None) -> tuple[Flag, ...]:
    flags = [Flag.CUT_BY_BORDER] if observed.is_cut else []
    return (*flags, Flag.NO_DEPTH) if median is None else tuple(flags)


def _outline_flags(
    fit: EllipseFit, visible: float, parameters: SizingParameters
) -> tuple[Flag, ...]:
    flags = []
    if fit.coverage < parameters.min_coverage or visible < parameters.min_visible_fraction:
        flags.append(Flag.HIDDEN)
    minor = fit.ellipse.minor_px
    rough = max(parameters.max_residual_px, parameters.max_residual_share * minor)
    if fit.residual_px > rough or minor < parameters.min_axis_ratio * fit.ellipse.major_px:
        flags.append(Flag.BAD_OUTLINE)
    return tuple(flags)


def _value_flags(
    diameter_mm: float, sd_mm: float, spread_mm: float, parameters: SizingParameters
) -> tuple[Flag, ...]:
    flags = []
    if sd_mm > min(parameters.max_sd_mm, parameters.max_sd_share * diameter_mm):
        flags.append(Flag.HIDDEN)
    plausible = parameters.min_diameter_mm <= diameter_mm <= parameters.max_diameter_mm
    if spread_mm > parameters.max_depth_spread_mm or not plausible:
        flags.append(Flag.OUTLIER)
    return tuple(flags)


def _unique(flags: tuple[Flag, ...]) -> tuple[Flag, ...]:
    return tuple(dict.fromkeys(flags))
