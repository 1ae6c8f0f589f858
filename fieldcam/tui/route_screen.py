"""The Route screen: trees by clusters, coloured by state; Enter goes there."""

from __future__ import annotations

from itertools import groupby
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.coordinate import Coordinate
from textual.widgets import DataTable, Static

from fieldcam.session.commands import Walk
from fieldcam.session.state import WalkState
from fieldcam.store.walks import ClusterState, Stop
from fieldcam.tui.news import News
from fieldcam.tui.page import Page
from fieldcam.tui.telling import progress

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
        yield Static("Arrows choose a cluster, Enter goes there.", id="hint")
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

    def hear(self, told: News) -> None:
        """In place of the hint."""
        self.query_one("#hint", Static).update(Text(told.sentence))

    def on_data_table_cell_selected(self, event: DataTable.CellSelected) -> None:
        tag_id = self._tags.get(event.coordinate)
        if tag_id is None:
            self.hear(News("There is no cluster here: arrows choose one."))
            return
        self.walk.go_to(tag_id)
        self.app.pop_screen()

    def action_undo(self) -> None:
        self.walk.undo()

    def _fill(self, table: DataTable[Text], state: WalkState) -> None:
        trees = [list(stops) for _, stops in groupby(state.route.stops, key=lambda s: s.tree)]
        table.clear(columns=True)
        self._tags.clear()
        most = max(map(len, trees), default=0)
        table.add_columns("tree", *(f"cluster {n + 1}" for n in range(most)))
        for row, stops in enumerate(trees):
            self._tags |= {Coordinate(row, n + 1): stop.tag_id for n, stop in enumerate(stops)}
            cells = [self._cell(stop, stop.tag_id == state.tag_id) for stop in stops]
            empty = [Text()] * (len(table.columns) - 1 - len(cells))
            table.add_row(Text(stops[0].tree_label or "?"), *cells, *empty)

    def _cell(self, stop: Stop, here: bool) -> Text:
        colour = self.app.theme_variables[COLOURS[stop.state]]
        place = "*" if here else " "
        return Text(f"{place}{stop.tag_id} {WORDS[stop.state]}", colour)
