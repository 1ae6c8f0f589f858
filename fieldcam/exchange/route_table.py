"""Reads a planned route: a table with the columns `tree` and `tag`, in walking order.

Spreadsheets differ, so a CSV table with any separator, a workbook and a title above the heading
will do, other columns are passed over, an empty tree repeats the one above, and a table of just
two columns needs no heading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.calipers.cells import label_of, whole_number, whole_of
from fieldcam.exchange.tables.files import read_sheets
from fieldcam.exchange.tables.headings import Table, TableRow, find_table, table_of
from fieldcam.exchange.tables.merged import Repeated, filled_down
from fieldcam.exchange.tables.sheets import Sheet
from fieldcam.exchange.tables.trees import ROW, TREE, StandingTree, tree_names
from fieldcam.values import HIGHEST_TAG_ID

TAG = ("tag", "tag_id", "cluster")
_WHAT_IS_NEEDED = "It needs the columns tree and tag, in walking order."


@dataclass(frozen=True, slots=True)
class PlannedStop:
    """One cluster of a planned route."""

    tree: str
    """The tree's label."""
    tag_id: int


@dataclass(frozen=True, slots=True)
class PlannedRoute:
    """The clusters in walking order, and what was assumed, a sentence each."""

    stops: tuple[PlannedStop, ...]
    notes: tuple[str, ...]


def read_route(path: Path) -> PlannedRoute:
    """Raises BadInput with the line, or the sheet and row, that is wrong."""
    table = _table(path)
    rows, merged = _rows(table)
    if not rows:
        raise BadInput(f"{path.name} holds no tags.", _WHAT_IS_NEEDED)
    trees = [_tree(table, row) for row in rows]
    if not any(each.row for each in trees):
        _check_together(trees)
    names, renamed = tree_names(trees)
    tags = _tags(table, rows)
    stops = tuple(PlannedStop(name, tag) for name, tag in zip(names, tags, strict=True))
    return PlannedRoute(stops, tuple(filter(None, (merged, renamed))))


def _table(path: Path) -> Table:
    """Of the only sheet that holds a route."""
    filled = [sheet for sheet in read_sheets(path) if sheet.rows]
    if not filled:
        raise BadInput(f"{path.name} is empty.", _WHAT_IS_NEEDED)
    found = [table for sheet in filled if (table := find_table(sheet, _is_heading)) is not None]
    if len(found) > 1:
        sheets = ", ".join(table.sheet.title or "" for table in found)
        raise BadInput(f"More than one sheet of {path.name} holds a route: {sheets}.")
    if found:
        return found[0]
    if len(filled) == 1 and _needs_no_heading(filled[0]):
        return table_of(filled[0], 0, 0, ["tree", "tag"])
    top = " ".join(filter(None, filled[0].rows[0].cells))[:60]
    raise BadInput(
        f"{path.name} has no heading of a route; it begins with {top!r}.", _WHAT_IS_NEEDED
    )


def _is_heading(names: Sequence[str]) -> bool:
    return any(name in TREE for name in names) and any(name in TAG for name in names)


def _needs_no_heading(sheet: Sheet) -> bool:
    first = sheet.rows[0].cells
    return len(first) == 2 and whole_number(first[1]) is not None


def _rows(table: Table) -> tuple[list[TableRow], str]:
    columns = [name for name in (table.column(ROW), table.column(TREE)) if name]
    return filled_down(table, Repeated(columns))


def _tree(table: Table, row: TableRow) -> StandingTree:
    tree_row, tree = table.column(ROW), table.column(TREE) or ""
    if not row.cells[tree]:
        raise BadInput(f"{row.place}: the tree is missing.")
    return StandingTree(
        row.place, label_of(row.cells[tree_row]) if tree_row else "", label_of(row.cells[tree])
    )


def _check_together(trees: Sequence[StandingTree]) -> None:
    """A tree that comes again may be another one, numbered anew in its row."""
    left: dict[str, str] = {}
    before = ""
    for each in trees:
        if each.tree != before and each.tree in left:
            raise BadInput(
                f"{each.place}: tree {each.tree} comes again after tree {before}. It may be the"
                " same tree, or another one where trees are numbered anew in each row.",
                "Add a column row, with the number of the tree's row.",
            )
        left[each.tree] = each.place
        before = each.tree


def _tags(table: Table, rows: Sequence[TableRow]) -> list[int]:
    places: dict[int, str] = {}
    for row in rows:
        tag = _tag_id(row, row.cells[table.column(TAG) or ""])
        if tag in places:
            first = places[tag].rpartition(", ")[2]
            raise BadInput(f"{row.place}: tag {tag} is in {first} already.")
        places[tag] = row.place
    return list(places)


def _tag_id(row: TableRow, text: str) -> int:
    number = whole_of(text, row.place, "tag")
    if number > HIGHEST_TAG_ID:
        raise BadInput(f"{row.place}: there is no tag {number}: they end at {HIGHEST_TAG_ID}.")
    return number
