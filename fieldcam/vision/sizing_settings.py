"""What can be switched and set about the default way of sizing."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from fieldcam.vision.sizing.ellipse import FitParameters


@dataclass(frozen=True, slots=True)
class Corrections:
    """The parts of the default method, each of which an ablation may leave out."""

    subpixel: bool = True
    """Zero line of the logits instead of pixel centres."""
    own_edge: bool = True
    """Only edges that are the fruitlet's own, instead of the whole visible outline."""
    robust: bool = True
    """The reweighted fit with priors instead of OpenCV's fitEllipse."""
    center_depth: bool = True
    """Depth of the fruitlet's centre instead of the median disparity."""
    perspective: bool = True
    """Tangent cone and obliqueness of the line of sight."""


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """What a size's standard deviation is made of; `export.tune_uncertainty` fits it to true
    errors.

    The parts are independent. The outline's own says how well its points hold the ellipse, which
    is too little: they err together, and the eye's depth errs as well.
    """

    of_outline: float = 2.53
    """Times the outline's standard deviation."""
    of_width: float = 0.0
    """Times what the network says of its mask's width, where it says something."""
    least_mm: float = 0.0
    of_diameter: float = 0.0051

    def sd_mm(self, diameter_mm: float, outline_sd_mm: float, width_sd: float | None) -> float:
        """Standard deviation of a diameter; `width_sd` is a share of it."""
        parts = (
            self.of_outline * outline_sd_mm,
            self.of_width * (width_sd or 0.0) * diameter_mm,
            self.least_mm,
            self.of_diameter * diameter_mm,
        )
        return math.hypot(*parts)


@dataclass(frozen=True, slots=True)
class SizingParameters:
    """When a fruitlet is sized, and when it is only reported as seen."""

    fit: FitParameters = field(default_factory=FitParameters)
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    edge_bias_px: float = 0.0
    """How far outside the true edge a network draws its zero line, on average."""
    min_score: float = 0.9
    """A fruitlet that the network is less sure of is seen, not sized: where two overlap, such
    a detection is often a part of one or both."""
    max_sd_mm: float = 0.5
    """A diameter less certain than this is not given out."""
    max_sd_share: float = 0.12
    min_coverage: float = 0.45
    min_visible_fraction: float = 0.35
    max_residual_px: float = 1.0
    max_residual_share: float = 0.03
    min_axis_ratio: float = 0.65
    max_depth_spread_mm: float = 6.0
    min_diameter_mm: float = 2.0
    max_diameter_mm: float = 45.0
