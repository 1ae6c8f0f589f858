"""The Block screen: sizes so far by day, how fast the walk was, and what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import OptionList, Static
from textual.widgets.option_list import Option

from fieldcam.session.commands import GoTo
from fieldcam.session.over_days.days import BlockDay, block_days
from fieldcam.session.state import WalkState
from fieldcam.store.queries.durations import LONGEST_S
from fieldcam.store.queries.walks import ClusterState, Stop
from fieldcam.tui.screens.page import Page
from fieldcam.tui.screens.route_screen import WORDS
from fieldcam.tui.text.histogram import histogram

CALIPER_S = 30
"""Seconds per cluster by caliper (Freeman et al.)."""
HEADINGS = ("day", "accepted", "retaken", "skipped", "to read", "duration", "s a cluster")


class SizesByDay(Static):
    """A histogram as large as the widget."""

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id, markup=False)
        self._days: tuple[BlockDay, ...] = ()

    def show(self, days: tuple[BlockDay, ...]) -> None:
        self._days = days
        self.on_resize()

    def on_resize(self) -> None:
        sizes = [(day.day, day.sizes_mm) for day in self._days]
        self.update("\n".join(histogram(sizes, *self.content_size)))


class BlockScreen(Page):
    """Enter goes to the chosen one of the missing clusters."""

    CSS_PATH = "block_screen.tcss"
    TITLE = "Block"
    about = "Block: sizes by day, times, what is missing; Enter goes to a missing one."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,b", "app.pop_screen", "Back", tooltip="Back"),
        Binding("g", "app.growth", "Growth", tooltip="Growth: how many will stay"),
    ]

    def body(self) -> ComposeResult:
        with Horizontal(id="block"):
            yield SizesByDay(id="histogram")
            with Vertical(id="rest"):
                yield Static(id="missing-heading", markup=False)
                yield OptionList(id="missing", markup=False)
        yield Static(id="counts", markup=False)
        yield Static(id="said", markup=False)

    def show(self, state: WalkState) -> None:
        super().show(state)
        self._list_missing([s for s in state.route.stops if s.state is not ClusterState.ACCEPTED])
        block = state.route.block
        self.look_up(state.folder, lambda database: block_days(database, block), self._write)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        if event.option_id is not None:
            self.walk.do(GoTo(int(event.option_id)))
            self.app.pop_screen()

    def _list_missing(self, missing: Sequence[Stop]) -> None:
        heading = (
            f"{len(missing)} missing; Enter goes there" if missing else "No cluster is missing."
        )
        self.query_one("#missing-heading", Static).update(heading)
        options = self.query_one("#missing", OptionList)
        chosen = options.highlighted
        options.clear_options()
        options.add_options(
            Option(
                f"{stop.tag_id:4}  tree {stop.tree_label or '?':8}  {WORDS[stop.state]}",
                str(stop.tag_id),
            )
            for stop in missing
        )
        options.highlighted = min(chosen or 0, len(missing) - 1) if missing else None

    def _write(self, days: tuple[BlockDay, ...]) -> None:
        self.query_one("#counts", Static).update("\n".join(count_lines(days)))
        self.query_one(SizesByDay).show(days)


def count_lines(days: Sequence[BlockDay]) -> list[str]:
    """A table with a row for each day, and what the paper says of calipers."""
    table = [HEADINGS, *(_counts(day) for day in days)]
    widths = [max(len(row[n]) for row in table) for n in range(len(HEADINGS))]
    lines = [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        for row in table
    ]
    pauses = f"Pauses of more than {LONGEST_S / 60:.0f} min are left out."
    return [*lines, f"By caliper a cluster takes about {CALIPER_S} s. {pauses}"]


def _counts(day: BlockDay) -> tuple[str, ...]:
    per_cluster, whole = day.times.median_s, day.times.duration_s
    return (
        f"{day.day:%d %b}",
        *(str(n) for n in (day.accepted, day.retaken, day.skipped, day.unread)),
        "-" if whole is None else duration(whole),
        "-" if per_cluster is None else f"{per_cluster:.0f}",
    )


def duration(seconds: float) -> str:
    """Such as 1 h 05 min, or 48 s."""
    minutes = int(seconds // 60)
    if minutes < 1:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02} min"
