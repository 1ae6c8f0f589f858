"""Reads a planned route: a CSV table with the columns `tree` and `tag`, in walking order.

Spreadsheets differ, so any of comma, semicolon and tab parts the columns, other
columns are passed over, an empty tree repeats the one above, and a table of just
two columns needs no heading.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.csv_rows import read_rows
from fieldcam.values import HIGHEST_TAG_ID

COLUMNS = ("tree", "tag")
_WHAT_IS_NEEDED = "It needs the columns tree and tag, in walking order."


@dataclass(frozen=True, slots=True)
class PlannedStop:
    """One cluster of a planned route."""

    tree: str
    """The tree's label."""
    tag_id: int


def read_route(path: Path) -> tuple[PlannedStop, ...]:
    """The clusters in walking order; raises BadInput with the line that is wrong."""
    stops: dict[int, PlannedStop] = {}
    lines: dict[int, int] = {}
    for line, stop in _stops(path):
        if stop.tag_id in stops:
            first = lines[stop.tag_id]
            raise _wrong(path, line, f"tag {stop.tag_id} is in line {first} already")
        stops[stop.tag_id], lines[stop.tag_id] = stop, line
    if not stops:
        raise BadInput(f"{path.name} holds no tags.", _WHAT_IS_NEEDED)
    return tuple(stops.values())


def _stops(path: Path) -> Iterator[tuple[int, PlannedStop]]:
    """Each with the number of its line, counted from 1."""
    table = read_rows(path)
    line, first = next(table, (1, []))
    places = _places(first)
    if places is None:
        raise BadInput(f"{path.name}, line {line}: there is no heading.", _WHAT_IS_NEEDED)
    tree_at, tag_at = places
    tree = ""
    if _is_heading(first):
        body: Iterable[tuple[int, list[str]]] = table
    else:
        body = [(line, first), *table]
    for line, cells in body:
        tree = _cell(cells, tree_at) or tree
        tag = _cell(cells, tag_at)
        if not tree:
            raise _wrong(path, line, "the tree is missing")
        yield line, PlannedStop(tree, _tag_id(path, line, tag))


def _places(cells: list[str]) -> tuple[int, int] | None:
    """Which columns hold the tree and the tag."""
    names = [cell.lower() for cell in cells]
    if _is_heading(cells):
        return names.index("tree"), names.index("tag")
    return (0, 1) if len(cells) == 2 and _whole(cells[1]) is not None else None


def _is_heading(cells: list[str]) -> bool:
    return set(COLUMNS) <= {cell.lower() for cell in cells}


def _cell(cells: list[str], index: int) -> str:
    return cells[index] if index < len(cells) else ""


def _tag_id(path: Path, line: int, text: str) -> int:
    number = _whole(text)
    if number is None:
        raise _wrong(path, line, f"{text!r} is no tag number" if text else "the tag is missing")
    if number > HIGHEST_TAG_ID:
        raise _wrong(path, line, f"there is no tag {number}: they end at {HIGHEST_TAG_ID}")
    return number


def _whole(text: str) -> int | None:
    """Spreadsheets write whole numbers as 17.0 at times."""
    digits = text.removesuffix(".0")
    return int(digits) if digits.isascii() and digits.isdigit() and len(digits) < 10 else None


def _wrong(path: Path, line: int, what: str) -> BadInput:
    return BadInput(f"{path.name}, line {line}: {what}.")
