"""Figures of a report, rounded to what means something."""

from __future__ import annotations

from collections.abc import Iterable


def rounded(value: float | None, digits: int) -> float | None:
    """None where nothing is known."""
    return None if value is None else round(float(value), digits)


def each_rounded(values: Iterable[float], digits: int) -> list[float]:
    """One after the other; numpy's numbers become Python's."""
    return [round(float(value), digits) for value in values]
