"""What makes the growth of one fruitlet doubtful: one rule for forecast, report, table, screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import date
from enum import StrEnum

from fieldcam.growth.records import FruitletRecord, Sighting

SURE = 0.9
"""Matches below this certainty are doubtful: marked, and no part of the reference."""
MOST_MM_PER_DAY = 2.5
"""No fruitlet grows faster: one of its two sizes is wrong, or they are of two fruitlets."""


class Doubt(StrEnum):
    """Why a fruitlet's growth between two visits may be none."""

    MATCH = "doubtful_match"
    """It may be another fruitlet than on the visits before."""
    GROWTH = "impossible_growth"
    """No fruitlet grows so fast."""


def is_doubtful(seen: Sighting) -> bool:
    """Whether it may be another fruitlet than on the visits before."""
    return seen.confidence < SURE


def doubts_told(fruitlet: FruitletRecord, days: Sequence[date]) -> Iterator[str]:
    """All that is doubtful about its sizes on these days, such as "53 % sure on 2026-05-14"."""
    sized = [(day, seen) for day in days if (seen := fruitlet.sightings.get(day)) is not None]
    before: tuple[date, float] | None = None
    for day, seen in sized:
        if seen.diameter_mm is None:
            continue
        if is_doubtful(seen):
            yield f"{seen.confidence * 100:.0f} % sure on {day}"
        if before is not None:
            rate = (seen.diameter_mm - before[1]) / (day - before[0]).days
            if rate > MOST_MM_PER_DAY:
                yield f"{rate:.1f} mm/day to {day}, which no fruitlet grows"
        before = day, seen.diameter_mm
