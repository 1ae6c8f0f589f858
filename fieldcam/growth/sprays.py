"""Thinning sprays, whose effect a forecast has to wait for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date


@dataclass(frozen=True, slots=True)
class SprayDay:
    """One spray of a block."""

    sprayed_on: date
    product: str = ""
    """Empty where nobody said."""


def last_spray(sprays: Sequence[SprayDay], until: date) -> SprayDay | None:
    """The last one up to a day; None where there was none."""
    past = [spray for spray in sprays if spray.sprayed_on <= until]
    return max(past, key=lambda spray: spray.sprayed_on, default=None)
