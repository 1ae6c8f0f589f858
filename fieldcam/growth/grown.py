"""What one fruitlet grew between two of its sizes, and how well that is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from fieldcam.growth.records import FruitletRecord, Sighting
from fieldcam.growth.visits import BlockVisit

_DIGITS = 9
Measured = tuple[date, Sighting]
"""What is known of a fruitlet, and the day of it."""


@dataclass(frozen=True, slots=True)
class Growth:
    """A fruitlet's two sizes, each with the fruitlet's own day."""

    start_mm: float
    end_mm: float
    days: int
    sd_mm: float | None = None
    """Standard deviation of what it grew, by those of its sizes; None where one is unknown."""

    @property
    def grown_mm(self) -> float:
        """Rounded where binary fractions end, so that a tie of written sizes is a tie."""
        return round(self.end_mm - self.start_mm, _DIGITS)

    @property
    def rate_mm_per_day(self) -> float:
        """Rounded likewise."""
        return round((self.end_mm - self.start_mm) / self.days, _DIGITS)


def growth_of(before: Measured | None, after: Measured | None) -> Growth | None:
    """None where one of the two sizes is not known."""
    if before is None or after is None:
        return None
    (start, one), (end, other) = before, after
    if one.diameter_mm is None or other.diameter_mm is None:
        return None
    sd_mm = sd_of_difference(one.sd_mm, other.sd_mm)
    return Growth(one.diameter_mm, other.diameter_mm, (end - start).days, sd_mm)


def ends_of(
    fruitlet: FruitletRecord, visits: Sequence[BlockVisit]
) -> tuple[Measured | None, Measured | None]:
    """What is known on the last of some visits, and the earliest size of those before it; without
    one, what is known on the first of them."""
    seen = [visit.sighting(fruitlet) for visit in visits]
    sized = (each for each in seen[:-1] if each is not None and each[1].diameter_mm is not None)
    return next(sized, seen[0]), seen[-1]


def sd_of_difference(one_mm: float | None, other_mm: float | None) -> float | None:
    """Of two sizes by their standard deviations; None where one of these is unknown."""
    return None if one_mm is None or other_mm is None else math.hypot(one_mm, other_mm)
