"""The sizes that a caliper table holds, whatever its shape."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import date
from statistics import median

from fieldcam.errors import BadInput
from fieldcam.exchange.calipers.cells import SizeCell, size_of
from fieldcam.exchange.calipers.shapes import CaliperCell, SaidCell
from fieldcam.exchange.tables.dates import Calendar
from fieldcam.exchange.tables.sheets import too_large
from fieldcam.exchange.tables.trees import tree_names
from fieldcam.foreign.bounds import MAX_FRUITS
from fieldcam.growth.records import Presence, SizeSource

SIZES_MM = (1.0, 100.0)
MIN_MEDIAN_MM = 3.5
"""Of a day: below it the sizes are most likely in centimetres."""


@dataclass(frozen=True, slots=True)
class FruitOnDay:
    """One cell: a fruit on one day."""

    place: str
    """Where it stands, for complaints."""
    tree: str
    """Empty where the table names none."""
    cluster: int
    fruit: str
    """Empty where fruits have no names."""
    day: date
    written: str
    diameter_mm: float | None
    presence: Presence | None = None
    """Where a word, or a column of states, says it."""
    source: SizeSource = SizeSource.CALIPERS
    nothing: bool = False
    """A word such as NA stands there."""
    certainty: float = 1.0
    """Of the match, where a camera measured."""


def sizes_of(cells: Sequence[CaliperCell], calendar: Calendar) -> tuple[list[FruitOnDay], str]:
    """What the cells say, by the dates of the whole file; and a note on the trees' names.

    A word such as NA is an empty cell where no other cell is empty, as a program writes it; beside
    empty ones it says that nothing was measured.
    """
    trees, note = tree_names([each.tree for each in cells])
    said = [size_of(each.text, each.place) for each in cells]
    some_empty = any(not each.text for each in cells)
    sizes = [
        _size(cell, tree, each, calendar, some_empty)
        for cell, tree, each in zip(cells, trees, said, strict=True)
    ]
    return sizes, note


def _size(
    cell: CaliperCell, tree: str, said: SizeCell, calendar: Calendar, some_empty: bool
) -> FruitOnDay:
    presence = said.presence
    if said.nothing and some_empty:
        presence = Presence.NOT_SEEN
    if cell.state is not None:
        presence = _stated(cell.state, said.diameter_mm)
    return FruitOnDay(
        cell.place,
        tree,
        cell.cluster,
        cell.fruit,
        calendar.days[cell.day.text],
        cell.text,
        said.diameter_mm,
        presence,
        cell.source,
        bool(said.nothing),
        1.0 if cell.certainty is None else _certainty(cell.certainty),
    )


def _certainty(cell: SaidCell) -> float:
    with suppress(ValueError):
        value = float(cell.text)
        if 0.0 <= value <= 1.0:
            return value
    raise BadInput(f"{cell.place}: {cell.text!r} is no certainty from 0 to 1.")


def _stated(state: SaidCell, diameter_mm: float | None) -> Presence:
    if state.text not in list(Presence):
        raise BadInput(f"{state.place}: {state.text!r} is none of {', '.join(Presence)}.")
    if (state.text == Presence.SIZED) != (diameter_mm is not None):
        raise BadInput(f"{state.place}: a fruit has a size exactly where it is {Presence.SIZED}.")
    return Presence(state.text)


def check_sizes(name: str, sizes: Sequence[FruitOnDay]) -> None:
    """Raises BadInput for what cannot be sizes of fruitlets in mm, and for repeated ones."""
    known = [each for each in sizes if each.diameter_mm is not None]
    if not known:
        raise BadInput(f"{name} holds no sizes.")
    if len({(each.tree, each.cluster, each.fruit) for each in sizes}) > MAX_FRUITS:
        raise too_large(name, f"more than {MAX_FRUITS:,} fruits")
    _check_millimetres(name, known)
    _check_fallen(sizes)
    low, high = SIZES_MM
    for each in known:
        if each.diameter_mm is not None and not low <= each.diameter_mm <= high:
            raise BadInput(f"{each.place}: {each.written} mm is no size of a fruitlet.")
    _check_once(sizes)


def _check_millimetres(name: str, sizes: Sequence[FruitOnDay]) -> None:
    by_day: dict[date, list[float]] = {}
    for each in sizes:
        by_day.setdefault(each.day, []).append(each.diameter_mm or 0.0)
    for day, diameters_mm in sorted(by_day.items()):
        if (middle := median(diameters_mm)) < MIN_MEDIAN_MM:
            raise BadInput(
                f"{name}: the sizes of {day} are {middle:.2g} in the middle; are they in"
                " centimetres?",
                "fieldcam needs millimetres.",
            )


def _check_fallen(sizes: Sequence[FruitOnDay]) -> None:
    """What has fallen, by a word in a cell, has no size any more."""
    fell: dict[tuple[str, int, str], FruitOnDay] = {}
    for each in sorted(sizes, key=lambda each: each.day):
        key = each.tree, each.cluster, each.fruit
        if each.fruit and each.written and each.presence is Presence.FALLEN:
            fell.setdefault(key, each)
        elif each.diameter_mm is not None and (before := fell.get(key)):
            raise BadInput(
                f"{each.place}: fruit {each.fruit} of cluster {each.cluster} has a size on"
                f" {each.day}, but is {before.written!r} on {before.day}"
                f" ({_end_of(before.place, each.place)})."
            )


def source_of(name: str, sizes: Sequence[FruitOnDay]) -> SizeSource:
    """Who measured them all; raises BadInput where it was one and the other."""
    sources = {each.source for each in sizes}
    if len(sources) > 1:
        raise BadInput(
            f"{name} mixes sizes by camera and by calipers, whose errors differ.",
            "Put them into tables of their own.",
        )
    return sources.pop()


def _check_once(sizes: Sequence[FruitOnDay]) -> None:
    places: dict[tuple[str, int, str, date], str] = {}
    for each in sizes:
        key = each.tree, each.cluster, each.fruit, each.day
        if each.fruit and key in places:
            raise BadInput(
                f"{each.place}: fruit {each.fruit} of cluster {each.cluster} on {each.day} is"
                f" in {_end_of(places[key], each.place)} already."
            )
        places[key] = each.place


def named_by_size(sizes: Sequence[FruitOnDay]) -> list[FruitOnDay]:
    """Fruits without names get "1" for the largest of the cluster on the day, "2" and so on.

    Raises BadInput where only some fruits of a cluster have names.
    """
    groups: dict[tuple[int, date], list[FruitOnDay]] = {}
    named = {each.cluster for each in sizes if each.fruit}
    for each in sizes:
        if not each.fruit and each.cluster in named:
            raise BadInput(
                f"{each.place}: this fruit of cluster {each.cluster} has no name, but others have."
            )
        if not each.fruit:
            groups.setdefault((each.cluster, each.day), []).append(each)
    found = [each for each in sizes if each.fruit]
    for group in groups.values():
        group.sort(key=lambda each: -(each.diameter_mm or 0.0))
        found += [replace(each, fruit=str(rank)) for rank, each in enumerate(group, start=1)]
    return found


def in_one_numbering(name: str, sizes: Sequence[FruitOnDay]) -> tuple[list[FruitOnDay], str]:
    """Clusters that are numbered anew on each tree get numbers of their own, and a note says so.

    Raises BadInput where a single cluster is on two trees.
    """
    trees: dict[int, dict[str, str]] = {}
    for each in sizes:
        trees.setdefault(each.cluster, {}).setdefault(each.tree, each.place)
    twice = {cluster: places for cluster, places in trees.items() if len(places) > 1}
    if not twice:
        return list(sizes), ""
    if 2 * len(twice) <= len(trees) or len(trees) < 2:
        cluster, places = next(iter(twice.items()))
        (one, there), (other, here), *_ = places.items()
        raise BadInput(
            f"{here}: cluster {cluster} is on tree {other or 'without a name'}, but on tree"
            f" {one or 'without a name'} in {_end_of(there, here)}; were tags swapped?"
        )
    return _renumbered(name, sizes)


def _renumbered(name: str, sizes: Sequence[FruitOnDay]) -> tuple[list[FruitOnDay], str]:
    order = list(dict.fromkeys(each.tree for each in sizes))
    width = 10 ** len(str(max(each.cluster for each in sizes)))
    numbers = {tree: place * width for place, tree in enumerate(order, start=1)}
    first = sizes[0]
    note = (
        f"{name} numbers the clusters anew on each tree: cluster {first.cluster} of tree"
        f" {first.tree} is called {numbers[first.tree] + first.cluster} here, and so on."
    )
    return [replace(each, cluster=numbers[each.tree] + each.cluster) for each in sizes], note


def _end_of(place: str, here: str) -> str:
    """A place without what the complaint's own place said already."""
    file, _, rest = place.partition(", ")
    return rest if here.startswith(f"{file}, ") and rest else place
