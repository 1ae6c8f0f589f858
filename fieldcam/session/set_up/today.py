"""The day that a walk counts for, and why the clock's word on it may be doubted."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date, datetime, timedelta

from fieldcam import RELEASED
from fieldcam.exchange.capture_folder import recording_day
from fieldcam.growth.warnings.dates import LONGEST_SEASON
from fieldcam.store.clock import Moment


@dataclass(frozen=True, slots=True)
class AnotherDay:
    """The calendar has gone on while a visit was walked."""

    of_visit: date
    now: date


def day_of(moment: Moment) -> date:
    """The day that a walk counts for: one that goes on past midnight stays one visit."""
    local: datetime = moment.utc + timedelta(minutes=moment.utc_offset_min)
    return recording_day(local)


def told(day: date) -> str:
    """As a person says it."""
    return f"{day:%d %b %Y}"


def clock_doubt(day: date, walked: Iterable[date]) -> str | None:
    """Why no clock that is right can say this day; `walked` are days of earlier visits."""
    last = max(walked, default=day)
    if last > day:
        why = f", but the last visit was on {told(last)}"
    elif day < RELEASED:
        why = ", which is before this version of fieldcam was made"
    else:
        return None
    return f"The clock says {told(day)}{why}. Is today {told(day)}?"


def season_doubt(block: str, day: date, walked: Iterable[date]) -> str | None:
    """Why a block may be that of another season; `walked` are the days of its own visits."""
    last = max(walked, default=day)
    if day - last <= LONGEST_SEASON:
        return None
    return (
        f"Block {block} was last walked on {told(last)}, and a block is one season. Is today's"
        f" walk, of {told(day)}, still of {block}?"
    )
