"""What makes the growth of one fruitlet doubtful: one rule for forecast, report, table, screen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import date
from enum import StrEnum

from fieldcam.growth.grown import Growth, Measured, growth_of
from fieldcam.growth.noise import NOISE, SizingNoise
from fieldcam.growth.records import FruitletRecord, Sighting, SizeSource

SURE = 0.9
"""Matches below this certainty are doubtful: marked, and no part of the reference."""
MAX_MM_PER_DAY = 2.5
"""No fruitlet grows faster: one of its two sizes is wrong, or they are of two fruitlets."""
SHRUNK_SD = 3.0
"""No fruitlet shrinks: one that seems to by so many standard deviations of what it grew has a
wrong size, or is another one."""


class Doubt(StrEnum):
    """Why a fruitlet's growth between two visits may be none."""

    MATCH = "doubtful_match"
    """It may be another fruitlet than on the visits before."""
    GROWTH = "impossible_growth"
    """No fruitlet grows so fast."""
    SHRUNK = "shrunk"
    """It shrank by more than the errors of its two sizes."""


def is_doubtful(seen: Sighting) -> bool:
    """Whether it may be another fruitlet than on the visits before."""
    return seen.confidence < SURE


def growth_doubt(growth: Growth, noise: SizingNoise) -> Doubt | None:
    """What its two sizes say against it; `noise` is that of sizes which do not say their own."""
    if growth.rate_mm_per_day > MAX_MM_PER_DAY:
        return Doubt.GROWTH
    sd_mm = growth.sd_mm or noise.growth_sd_mm(growth.start_mm, growth.end_mm)
    return Doubt.SHRUNK if growth.grown_mm < -SHRUNK_SD * sd_mm else None


def may_be_reference(doubts: Iterable[Doubt]) -> bool:
    """Whether one of the fastest with these doubts counts; what shrank is never among them."""
    return all(doubt is Doubt.SHRUNK for doubt in doubts)


def doubts_told(
    fruitlet: FruitletRecord, days: Sequence[date], source: SizeSource = SizeSource.CAMERA
) -> Iterator[str]:
    """All that is doubtful about its sizes on these days, such as "53 % sure on 2026-05-14"."""
    seen_on = [(day, seen) for day in days if (seen := fruitlet.sightings.get(day)) is not None]
    before: Measured | None = None
    for day, seen in seen_on:
        if seen.diameter_mm is None:
            continue
        if is_doubtful(seen):
            yield f"{seen.confidence * 100:.0f} % sure on {day}"
        growth = growth_of(before, (day, seen))
        if growth is not None and (told := _told(growth, day, NOISE[source])):
            yield told
        before = day, seen


def _told(growth: Growth, day: date, noise: SizingNoise) -> str:
    match growth_doubt(growth, noise):
        case Doubt.GROWTH:
            return f"{growth.rate_mm_per_day:.1f} mm/day to {day}, which no fruitlet grows"
        case Doubt.SHRUNK:
            return f"{-growth.grown_mm:.1f} mm less on {day}, which no fruitlet shrinks"
        case _:
            return ""
