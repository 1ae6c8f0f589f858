"""Doubts about the dates of a caliper table: a slip in a year costs a forecast."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import date, timedelta
from itertools import pairwise

from fieldcam.growth.warnings import Warning

LONGEST_BREAK = timedelta(days=120)
"""Between two visits of a season: from bloom to harvest it is hardly longer."""
FIRST_YEAR = 2000
"""Growth has been forecast from fruitlets since about then."""


def date_doubts(name: str, days: Sequence[date], today: date) -> tuple[Warning, ...]:
    """What is odd about the dates of a table, rising and each once."""
    return tuple(_doubts(name, days, today))


def _doubts(name: str, days: Sequence[date], today: date) -> Iterator[Warning]:
    if future := [day for day in days if day > today]:
        yield Warning(
            "future_dates",
            f"{name} has sizes of {_listed(future)}, but today is {today}: is a date wrong, or the"
            " clock of this machine?",
        )
    if old := [day for day in days if day.year < FIRST_YEAR]:
        yield Warning("old_dates", f"{name} has sizes of {_listed(old)}: is the year right?")
    breaks = [(one, other) for one, other in pairwise(days) if other - one > LONGEST_BREAK]
    for one, other in breaks[:1]:
        yield Warning(
            "dates_far_apart",
            f"Between {one} and {other} in {name} lie {(other - one).days:,} days: is a year wrong,"
            " or does it hold two seasons? Then each needs a table of its own.",
        )


def _listed(days: Sequence[date]) -> str:
    return ", ".join(map(str, days[:3])) + (" and more" if len(days) > 3 else "")
