"""Sizes beside the truth of a simulated capture."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldcam.exchange.rounding import rounded
from fieldcam.values import ClusterReading, Fruitlet, Status

if TYPE_CHECKING:
    from fieldcam.simulator import TrueFruitlet, Truth

SAME_FRUITLET_IOU = 0.3
"""Masks that share less than this are of two different fruitlets."""
WELL_VISIBLE = 0.6
"""Visible fraction from which on a fruitlet ought to get a size."""


@dataclass(frozen=True, slots=True)
class Scored:
    """One reading beside the fruitlet that it belongs to; one of the two may be missing."""

    reading: Fruitlet | None
    truth: TrueFruitlet | None

    @property
    def error_mm(self) -> float | None:
        if self.reading is None or self.truth is None or self.reading.diameter_mm is None:
            return None
        return self.reading.diameter_mm - self.truth.diameter_mm


@dataclass(frozen=True, slots=True)
class ScoredCapture:
    """One capture's target cluster beside its truth."""

    reading: ClusterReading
    fruitlets: tuple[Scored, ...]
    """The true target fruitlets in the order of their identities, then foreign readings."""

    @property
    def foreign(self) -> int:
        """Readings in the target that are no fruitlet of it."""
        return sum(s.truth is None or not s.truth.in_target for s in self.fruitlets)


def score_capture(reading: ClusterReading, truth: Truth) -> ScoredCapture:
    """Pair the readings of the target with the true fruitlets."""
    partners = _partners(reading.target, truth.fruitlets)
    own = sorted(truth.target, key=lambda t: t.id)
    taken = {id(t): f for f, t in partners if t is not None}
    scored = [Scored(taken.get(id(t)), t) for t in own]
    scored += [Scored(f, t) for f, t in partners if t is None or not t.in_target]
    return ScoredCapture(reading, tuple(scored))


def summary(captures: Iterable[ScoredCapture]) -> dict[str, Any]:
    """The figures that belong together, for people and scripts; None where nothing counts."""
    captures = list(captures)
    own = [s for c in captures for s in c.fruitlets if s.truth is not None and s.truth.in_target]
    visible = [s for s in own if s.truth is not None and s.truth.visible_fraction >= WELL_VISIBLE]
    errors = np.array([s.error_mm for s in own if s.error_mm is not None])
    readings = sum(len(c.reading.target) for c in captures)
    return {
        "captures": len(captures),
        "sizes": len(errors),
        "mae_mm": rounded(np.abs(errors).mean() if len(errors) else None, 4),
        "bias_mm": rounded(errors.mean() if len(errors) else None, 4),
        "p95_mm": rounded(np.quantile(np.abs(errors), 0.95) if len(errors) else None, 4),
        "sized_share_well_visible": _share(_sized(visible), len(visible)),
        "sized_share_all": _share(_sized(own), len(own)),
        "foreign_share": _share(sum(c.foreign for c in captures), readings),
        "retakes": sum(c.reading.verdict.status is Status.RETAKE for c in captures),
    }


def _partners(
    readings: Sequence[Fruitlet], truths: Sequence[TrueFruitlet]
) -> list[tuple[Fruitlet, TrueFruitlet | None]]:
    """Each reading's fruitlet: best overlaps first, no fruitlet twice."""
    overlaps = sorted(
        (
            (f.mask.iou(t.visible), i, j)
            for i, f in enumerate(readings)
            for j, t in enumerate(truths)
        ),
        reverse=True,
    )
    found: dict[int, int] = {}
    for iou, i, j in overlaps:
        if iou >= SAME_FRUITLET_IOU and i not in found and j not in found.values():
            found[i] = j
    return [(f, truths[found[i]] if i in found else None) for i, f in enumerate(readings)]


def _sized(scored: Sequence[Scored]) -> int:
    return sum(s.error_mm is not None for s in scored)


def _share(part: int, whole: int) -> float | None:
    return round(part / whole, 4) if whole else None
