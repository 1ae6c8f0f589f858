"""What is odd about the dates of visits: a slip of the pen, or a clock that was wrong."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from datetime import date, timedelta
from itertools import pairwise

from fieldcam.words import number_of

EARLIEST_YEAR = 1990
"""No older table is in use; two figures, or a slip, make such years."""
LONGEST_INTERVAL = timedelta(days=60)
"""Between two visits; fruitlets are thinned, and have fallen, within weeks of bloom."""
LONGEST_SEASON = timedelta(days=150)
"""Between two visits of one block; more is another season."""


def doubtful_dates(days: Sequence[date], today: date | None = None) -> Iterator[tuple[str, str]]:
    """A code and a sentence for each doubt about rising days; `today` is what the clock says."""
    later = [] if today is None else [day for day in days if day > today]
    if later:
        yield (
            "future_dates",
            f"{_listed(later)} {_lie(later)} after today, which is {today} by this machine's"
            " clock. Is the year right?",
        )
    early = [day for day in days if day.year < EARLIEST_YEAR]
    if early:
        yield "odd_year", f"{_listed(early)} {_lie(early)} long ago. Is the year right?"
    for before, after in pairwise(days):
        if after - before > LONGEST_SEASON:
            yield "two_seasons", f"{_gap(before, after)}: a block is one season. Is a year wrong?"
        elif after - before > LONGEST_INTERVAL:
            yield (
                "long_interval",
                f"{_gap(before, after)}, and fruitlets fall within weeks. Is a date wrong?",
            )


def other_year(days: Set[date], others: Set[date]) -> str:
    """A sentence where two kinds of days have only the year not in common; else empty."""
    if days & others:
        return ""
    without_year = {(day.month, day.day) for day in others}
    shared = sorted(day for day in days if (day.month, day.day) in without_year)
    if not shared:
        return ""
    years = sorted({day.year for day in others})
    return (
        f"But for the year {_listed(shared)} would be of the pictures ({years[-1]}): is it right?"
    )


def _gap(before: date, after: date) -> str:
    between = number_of((after - before).days, "day")
    return f"From the visit of {before} to that of {after} there are {between}"


def _listed(days: Sequence[date]) -> str:
    return ", ".join(map(str, days))


def _lie(days: Sequence[date]) -> str:
    return "lies" if len(days) == 1 else "lie"
