"""Trees of a table by a name that only one of them has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fieldcam.errors import BadInput

ROW = ("row", "tree_row", "row_id")
TREE = ("tree", "tree_id")


@dataclass(frozen=True, slots=True)
class StandingTree:
    """A tree as one line of a table calls it."""

    place: str
    """Of the line."""
    row: str
    """Of trees in the orchard; empty where the table says none."""
    tree: str


def tree_names(trees: Sequence[StandingTree]) -> tuple[list[str], str]:
    """A name for each, such as 2-1 for tree 1 of row 2 where each row has a tree 1; and a note.

    Raises BadInput where it is unclear whether a column counts rows of trees, or lines.
    """
    rows_of: dict[str, set[str]] = {}
    for each in trees:
        rows_of.setdefault(each.tree, set()).add(each.row)
    again = next((tree for tree, rows in rows_of.items() if tree and len(rows) > 1), None)
    if again is None:
        return [each.tree for each in trees], ""
    lines = list({each.place: each for each in trees}.values())
    if len({each.row for each in lines}) == len(lines) > 2:
        _, second, *_ = (each for each in lines if each.tree == again)
        raise BadInput(
            f"{second.place}: the column row differs in each line; it may count the lines, or tree"
            f" {again} is another tree in each row.",
            "Leave the column out if it counts the lines; else call the trees such as 2-1.",
        )
    names = [f"{each.row}-{each.tree}" if each.row and each.tree else each.tree for each in trees]
    example = next(each for each in trees if each.tree == again and each.row)
    note = (
        "Trees are numbered anew in each row:"
        f" tree {again} of row {example.row} is called {example.row}-{again}."
    )
    return names, note
