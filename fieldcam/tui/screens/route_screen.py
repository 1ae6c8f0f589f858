"""The Route screen: trees by clusters, coloured by state; Enter goes there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby, zip_longest
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.coordinate import Coordinate
from textual.events import Resize
from textual.widgets import DataTable, Static

from fieldcam.session.commands import GoTo, UndoLast, Walk
from fieldcam.session.state import WalkState
from fieldcam.store.queries.walks import ClusterState, Stop
from fieldcam.tui.screens.page import Page
from fieldcam.tui.text.news import News
from fieldcam.tui.text.telling import progress

Trees = Sequence[Sequence[Stop]]
Words = Mapping[ClusterState, str]
COLOURS = {
    ClusterState.TODO: "foreground",
    ClusterState.WAITING: "primary",
    ClusterState.UNDECIDED: "warning",
    ClusterState.RETAKE: "error",
    ClusterState.ACCEPTED: "success",
    ClusterState.SKIPPED: "foreground",
}
WORDS = {
    ClusterState.TODO: "to do",
    ClusterState.WAITING: "reading",
    ClusterState.UNDECIDED: "decide",
    ClusterState.RETAKE: "RETAKE",
    ClusterState.ACCEPTED: "done",
    ClusterState.SKIPPED: "skipped",
}
SIGNS = {
    ClusterState.TODO: "-",
    ClusterState.WAITING: "..",
    ClusterState.UNDECIDED: "?",
    ClusterState.RETAKE: "R!",
    ClusterState.ACCEPTED: "ok",
    ClusterState.SKIPPED: "s",
}
"""Where the words of all clusters of a tree do not fit."""
HINT = "Arrows choose a cluster, Enter goes there."
LEGEND = "ok done  ? decide  R! RETAKE  - to do  .. reading  s skipped   Enter goes there."
PADDING = 2
"""Of each cell, both sides together."""


class RouteScreen(Page):
    """A row for each tree, a cell for each of its clusters."""

    CSS_PATH = "route_screen.tcss"
    TITLE = "Route"
    about = "Route: all trees and clusters. Arrows choose one, Enter goes there."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,o", "app.pop_screen", "Back to the walk", tooltip="Back to the walk"),
        Binding("u", "undo", "Undo", tooltip="Undo the last decision"),
    ]

    def __init__(self, walk: Walk, state: WalkState | None = None) -> None:
        super().__init__(walk, state)
        self._tags: dict[Coordinate, int] = {}

    def body(self) -> ComposeResult:
        yield DataTable[Text](id="trees", cursor_type="cell")
        yield Static(HINT, id="hint")
        yield Static(id="progress", markup=False)

    def show(self, state: WalkState) -> None:
        super().show(state)
        table = self.query_one("#trees", DataTable)
        first = not self._tags
        cursor = table.cursor_coordinate
        self._fill(table, state)
        anywhere = next(iter(self._tags), cursor)
        here = next((place for place, tag in self._tags.items() if tag == state.tag_id), anywhere)
        table.move_cursor(
            row=(here if first else cursor).row, column=(here if first else cursor).column
        )
        self.query_one("#progress", Static).update(progress(state))

    def on_resize(self, event: Resize) -> None:
        """Words or signs, as fits."""
        super().on_resize(event)
        if self.state is not None:
            self.show(self.state)

    def hear(self, told: News) -> None:
        """In place of the hint."""
        self.query_one("#hint", Static).update(Text(told.sentence))

    def on_data_table_cell_selected(self, event: DataTable.CellSelected) -> None:
        tag_id = self._tags.get(event.coordinate)
        if tag_id is None:
            self.hear(News("There is no cluster here: arrows choose one."))
            return
        self.walk.do(GoTo(tag_id))
        self.app.pop_screen()

    def action_undo(self) -> None:
        self.walk.do(UndoLast())

    def _fill(self, table: DataTable[Text], state: WalkState) -> None:
        trees = [list(stops) for _, stops in groupby(state.route.stops, key=lambda s: s.tree)]
        table.clear(columns=True)
        self._tags.clear()
        words, headings = WORDS, "cluster {}"
        if self._width(trees, words, headings) > self.app.size.width:
            words, headings = SIGNS, "{}"
            self.query_one("#hint", Static).update(LEGEND)
        table.add_column("tree", width=_tree_width(trees))
        for n, width in enumerate(self._widths(trees, words, headings), start=1):
            table.add_column(headings.format(n), width=width)
        for row, stops in enumerate(trees):
            self._tags |= {Coordinate(row, n + 1): stop.tag_id for n, stop in enumerate(stops)}
            cells = [self._cell(stop, words, stop.tag_id == state.tag_id) for stop in stops]
            empty = [Text()] * (len(table.columns) - 1 - len(cells))
            table.add_row(Text(stops[0].tree_label or "?"), *cells, *empty)

    def _width(self, trees: Trees, words: Words, headings: str) -> int:
        """Of the whole table."""
        widths = _tree_width(trees), *self._widths(trees, words, headings)
        return sum(width + PADDING for width in widths)

    def _widths(self, trees: Trees, words: Words, headings: str) -> list[int]:
        """Of each column of clusters."""
        columns = zip_longest(*trees)
        return [
            max(len(headings.format(n)), *(len(_text(s, words)) for s in column if s is not None))
            for n, column in enumerate(columns, start=1)
        ]

    def _cell(self, stop: Stop, words: Words, here: bool) -> Text:
        colour = self.app.theme_variables[COLOURS[stop.state]]
        return Text(_text(stop, words, "*" if here else " "), colour)


def _text(stop: Stop, words: Words, place: str = " ") -> str:
    return f"{place}{stop.tag_id} {words[stop.state]}"


def _tree_width(trees: Trees) -> int:
    return max(len(label) for label in ("tree", *(stops[0].tree_label for stops in trees)))
