"""What screens say of single fruit: their names and sizes by caliper."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fieldcam.growth.agreement import ENOUGH, Agreement
from fieldcam.store.queries.calipers import MeasuredFruit, NamedFruitlet
from fieldcam.store.rows.row import EntryId
from fieldcam.words import number_of, span


@dataclass(frozen=True, slots=True)
class Called:
    """A fruitlet that has a name."""

    fruit: str
    calipers_mm: float | None

    def __str__(self) -> str:
        measured = "" if self.calipers_mm is None else f" {self.calipers_mm:.2f}"
        return f'"{self.fruit}"{measured}'


def called(
    reading: EntryId, sizes: Iterable[MeasuredFruit], named: Iterable[NamedFruitlet]
) -> dict[int, Called]:
    """One reading's fruitlets that have a name, by their ids."""
    measured = {(size.tag_id, size.day, size.fruit): size.diameter_mm for size in sizes}
    return {
        seen.fruitlet: Called(seen.fruit, measured.get((seen.tag_id, seen.day, seen.fruit)))
        for seen in named
        if seen.reading == reading
    }


def agreement_line(found: Agreement | None) -> str:
    """Camera less calipers over the block; empty where nothing was measured both ways."""
    if found is None:
        return ""
    told = f"Camera less caliper, {number_of(found.n, 'fruitlet')}: {found.bias_mm:+.2f} mm"
    if found.limits_mm is None:
        return f"{told}; measure {ENOUGH - found.n} more to judge by it"
    return f"{told}, spread {found.sd_mm:.2f}, 95 % {span(found.limits_mm, '+.2f')}"
