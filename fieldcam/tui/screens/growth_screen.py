"""The Growth screen: how many fruitlets of the block will stay, and what speaks against it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from functools import partial
from typing import ClassVar

from sqlite_utils import Database
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.events import Resize
from textual.widgets import OptionList, Static
from textual.widgets.option_list import Option
from textual.worker import get_current_worker

from fieldcam.errors import BadInput
from fieldcam.growth.outlook import Outlook
from fieldcam.session.commands import Walk
from fieldcam.session.over_days.block_growth import KnownCluster, block_outlook, known_clusters
from fieldcam.session.over_days.growing import block_rows
from fieldcam.session.state import WalkState
from fieldcam.store.rows.row import EntryId
from fieldcam.tui.messages import LookedUp
from fieldcam.tui.screens.page import Page
from fieldcam.tui.text.growth_words import (
    WITHOUT,
    cluster_lines,
    heading,
    more_line,
    number_lines,
    told_lines,
    verdict_lines,
)
from fieldcam.tui.widgets.days_view import Past

KnownBlocks = dict[EntryId, dict[int, KnownCluster]]
"""Clusters that were followed, by block and tag."""
FOLLOWING = "Following clusters from day to day"


@dataclass(frozen=True, slots=True, eq=False)
class Grown:
    """What the clusters say together, or why they say nothing."""

    growth: Outlook | None
    problem: str


class GrowthScreen(Page):
    """Computed in a thread of its own, cluster by cluster."""

    CSS_PATH = "growth_screen.tcss"
    TITLE = "Growth"
    about = "Growth: how many fruitlets will stay. Up, down and Enter: a cluster's pictures."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,g", "app.block", "Back", tooltip="Back to the block"),
        # Before the list of clusters, which has the focus, takes them for itself.
        Binding(
            "pageup",
            "scroll(-1)",
            "Earlier words",
            show=False,
            priority=True,
            tooltip="Earlier words",
        ),
        Binding(
            "pagedown", "scroll(1)", "Later words", show=False, priority=True, tooltip="Later words"
        ),
    ]

    def __init__(self, walk: Walk, state: WalkState | None, known: KnownBlocks) -> None:
        """`known` outlives the screen, and is added to: following takes long."""
        super().__init__(walk, state)
        self._blocks = known
        self._block: EntryId | None = None
        self._growth: Outlook | None = None
        """The last one, to be drawn in another width."""

    def body(self) -> ComposeResult:
        yield Static(f"{FOLLOWING}.", id="heading", markup=False)
        yield Static(id="verdict", markup=False)
        yield Static(id="numbers", markup=False)
        with Horizontal(id="rest"):
            with Vertical(id="words"):
                with Past(id="told"):
                    yield Static(id="told-lines", markup=False)
                yield Static(id="more", markup=False)
            with Vertical(id="influence"):
                yield Static(WITHOUT, id="without", markup=False)
                yield Static(id="columns", markup=False)
                yield OptionList(id="clusters", markup=False, compact=True)
        yield Static(id="said", markup=False)

    def on_mount(self) -> None:
        super().on_mount()
        self.query_one("#influence").display = False
        for part in ("scroll_y", "virtual_size"):
            self.watch(self.query_one("#told"), part, self._moved)

    def show(self, state: WalkState) -> None:
        super().show(state)
        block = state.route.block
        if block != self._block:
            self._block, self._growth = block, None
        known = {**self._blocks.setdefault(block, {})}
        self.look_up(state.folder, partial(self._read, state, known), self._found)

    def on_resize(self, event: Resize) -> None:
        super().on_resize(event)
        if self._growth is not None:
            self.call_after_refresh(self._write, self._growth)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        if event.option_id is not None:
            self.looks_at = int(event.option_id)
            self.call_later(self.run_action, "app.cluster")

    def action_scroll(self, by: int) -> None:
        past = self.query_one("#told", Past)
        past.scroll_relative(y=by * max(1, past.size.height - 1), animate=False)

    def _read(
        self, state: WalkState, before: Mapping[int, KnownCluster], database: Database
    ) -> Grown:
        """In a thread, which stops between two clusters when nobody waits for it any more."""
        block, today = state.route.block, None if state.simulated else date.today()
        worker, rows = get_current_worker(), block_rows(database, block)
        known = {}
        for cluster in known_clusters(database, rows, before):
            known[cluster.rows.tag_id] = cluster
            if worker.is_cancelled:
                return Grown(None, "")
            if cluster is not before.get(cluster.rows.tag_id):
                learned = partial(self._learned, block, cluster, len(known), len(rows))
                self.post_message(LookedUp(learned))
        try:
            every = tuple(known.values())
            return Grown(block_outlook(database, block, every, today=today), "")
        except BadInput as error:
            return Grown(None, str(error))

    def _learned(self, block: EntryId, cluster: KnownCluster, done: int, clusters: int) -> None:
        """Kept at once, since news of the walk begins the whole anew."""
        self._blocks[block][cluster.rows.tag_id] = cluster
        if block == self._block and self._growth is None:
            line = f"{FOLLOWING}, {done} of {clusters}."
            self.query_one("#heading", Static).update(line)

    def _found(self, grown: Grown) -> None:
        self._growth = grown.growth
        if grown.growth is not None:
            self._write(grown.growth)
            return
        self.query_one("#heading", Static).update("No forecast yet")
        self.query_one("#verdict", Static).update(grown.problem)
        for part in ("#numbers", "#told-lines"):
            self.query_one(part, Static).update()
        self.query_one("#influence").display = False

    def _write(self, growth: Outlook) -> None:
        width = self.size.width - 2
        parts = {
            "#heading": [heading(growth)],
            "#verdict": verdict_lines(growth, width),
            "#numbers": number_lines(growth),
            "#told-lines": told_lines(growth),
        }
        for part, lines in parts.items():
            self.query_one(part, Static).update("\n".join(lines))
        self._list_clusters(growth)

    def _list_clusters(self, growth: Outlook) -> None:
        columns, *lines = cluster_lines(growth.found.set_pct, growth.clusters)
        self.query_one("#columns", Static).update(columns)
        listed = self.query_one("#clusters", OptionList)
        chosen = listed.highlighted or 0
        listed.clear_options()
        listed.add_options(
            Option(line, str(each.tag_id))
            for line, each in zip(lines, growth.clusters, strict=True)
        )
        self.query_one("#influence").display = True
        listed.highlighted = min(chosen, len(lines) - 1)
        listed.focus()

    def _moved(self) -> None:
        """Only after the layout is the room known in which the words stand."""
        self.call_after_refresh(self._say_more)

    def _say_more(self) -> None:
        told = self.query_one("#told", Past)
        above = round(told.scroll_y)
        self.query_one("#more", Static).update(more_line(told.max_scroll_y - above, above))
