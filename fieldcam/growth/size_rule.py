"""Which size of a fruitlet counts where several pictures of a visit show it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from enum import StrEnum
from typing import Protocol, TypeVar

from fieldcam.growth.records import Presence, Sighting


class Sized(Protocol):
    """Whatever holds the size of one fruitlet in one picture."""

    @property
    def diameter_mm(self) -> float | None:
        """None where it was seen, but not sized."""

    @property
    def sd_mm(self) -> float | None:
        """Standard deviation of the diameter; None where it is unknown."""


AnySized = TypeVar("AnySized", bound=Sized)


class SizeRule(StrEnum):
    """By what one of several sizes is chosen."""

    BETTER_KNOWN = "better-known"
    """The smallest standard deviation; where that is unknown of all, the larger size."""
    LARGER = "larger"
    """As in the paper."""

    def chosen(self, views: Iterable[AnySized]) -> AnySized | None:
        """None where no view has a size."""
        sized = (view for view in views if view.diameter_mm is not None)
        return min(sized, key=self._order, default=None)

    def _order(self, view: Sized) -> tuple[float, float]:
        by_sd = self is SizeRule.BETTER_KNOWN and view.sd_mm is not None
        return (view.sd_mm or 0.0) if by_sd else math.inf, -(view.diameter_mm or 0.0)


def sighting_of(views: Iterable[Sized], rule: SizeRule) -> Sighting:
    """Of a fruitlet that a visit's pictures show."""
    counts = rule.chosen(views)
    if counts is None:
        return Sighting(Presence.SEEN)
    return Sighting(Presence.SIZED, counts.diameter_mm, sd_mm=counts.sd_mm)
