"""How wrong one size is: spread of the errors of the camera and of calipers.

The camera's was fitted to the sizes of two rendered blocks (docs/growth.md): most are within
0.2 mm, with a heavy tail of fruitlets whose outline is partly covered. The calipers' follows
from the paper's mean ranges of five repeats (0.50, 0.34 and 0.71 mm below 8, to 12 and above
12 mm); the range of five normal errors is 2.326 times their standard deviation on average.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcam.growth.records import SizeSource
from fieldcam.values import Floats

RANGE_OF_FIVE = 2.326
"""Mean range of five normal values of standard deviation 1 (d2 of control charts)."""


@dataclass(frozen=True, slots=True)
class SizingNoise:
    """A mixture of normal errors without bias, whose spreads depend on the size."""

    shares: tuple[float, ...]
    """Of each part of the mixture; they add to 1."""
    limits_mm: tuple[float, ...]
    """Where one class of sizes ends and the next begins."""
    sds_mm: tuple[tuple[float, ...], ...]
    """Standard deviations by class and part."""

    def of(self, diameters_mm: Floats) -> Floats:
        """(N, parts) standard deviations of N sizes, mm."""
        return np.array(self.sds_mm)[np.digitize(diameters_mm, self.limits_mm)]

    def growth_sd_mm(self, start_mm: float, end_mm: float) -> float:
        """Standard deviation of the difference of two sizes, all parts together."""
        sds = self.of(np.array([start_mm, end_mm]))
        return float(np.sqrt((sds**2 @ np.array(self.shares)).sum()))

    def drawn(self, rng: np.random.Generator, diameters_mm: Floats) -> Floats:
        """(N,) errors of one measurement each, mm."""
        parts = rng.choice(len(self.shares), diameters_mm.size, p=self.shares)
        sds = self.of(diameters_mm)[np.arange(diameters_mm.size), parts]
        return np.asarray(rng.normal(0.0, sds))


NOISE = {
    SizeSource.CAMERA: SizingNoise((0.92, 0.08), (), ((0.165, 0.75),)),
    SizeSource.CALIPERS: SizingNoise(
        (1.0,), (8.0, 12.0), tuple((mm / RANGE_OF_FIVE,) for mm in (0.50, 0.34, 0.71))
    ),
}
