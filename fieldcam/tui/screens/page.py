"""What all full screens share: the bar on top, the footer, and a word when there is no room."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from datetime import date
from functools import partial
from pathlib import Path
from typing import ClassVar, TypeVar

from sqlite_utils import Database
from textual import work
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.events import Resize
from textual.screen import Screen
from textual.widgets import Footer, Static
from textual.worker import get_current_worker

from fieldcam.errors import FieldcamError
from fieldcam.session.commands import Walk
from fieldcam.session.state import WalkState
from fieldcam.store.connection import connect_read_only
from fieldcam.store.store import DATABASE_NAME
from fieldcam.tui.looks import PictureStyle
from fieldcam.tui.messages import LookedUp
from fieldcam.tui.text.news import News
from fieldcam.tui.widgets.words import Words

_Found = TypeVar("_Found")
LEAST = (80, 24)
"""Columns and rows that a screen needs."""
WIDE = 160
"""Columns from which on a screen may show more."""
LOW_DISK_BYTES = 1_000_000_000
"""Below it the free space is shown in MB, and as bad."""


class FullScreen(Screen[None]):
    """A full screen: its bar, its body, its footer."""

    least: ClassVar[tuple[int, int]] = LEAST
    about: ClassVar[str] = ""
    """What the screen is for, on its help page."""

    def compose(self) -> ComposeResult:
        yield Static(id="small")
        with Vertical(id="page"):
            with Vertical(id="bar"):
                yield Words(id="simulated")
                yield Words(id="title", markup=False)
                yield Words(id="block-name", markup=False)
                yield Words(id="day", markup=False)
                yield Words(id="disk")
            yield from self.body()
            yield Footer(compact=True, show_command_palette=False)

    def body(self) -> ComposeResult:
        """The widgets between the bar and the footer."""
        return ()

    def show_bar(self, block: str, day: date, simulated: bool, free_bytes: int) -> None:
        """What stands on top."""
        self.query_one("#simulated", Words).update("SIMULATED")
        self.query_one("#simulated").display = simulated
        self.query_one("#title", Words).update(self.TITLE or "")
        self.query_one("#block-name", Words).update(block)
        self.query_one("#block-name").display = bool(block)
        self.query_one("#day", Words).update(f"{day:%d %b %Y}")
        low = free_bytes < LOW_DISK_BYTES
        free = f"{free_bytes / 1e6:.0f} MB" if low else f"{free_bytes / 1e9:.0f} GB"
        self.query_one("#disk", Words).update(f"{free} free")
        self.query_one("#disk").set_class(low, "-bad")

    def hear(self, told: News) -> None:
        """Say what came of a command, where the screen has a line for it."""
        for line in self.query("#said").results(Static):
            line.update(told.sentence)
            line.set_class(told.bad, "-bad")

    @work(thread=True, exclusive=True, group="store", exit_on_error=False)
    def look_up(
        self, folder: Path, read: Callable[[Database], _Found], show: Callable[[_Found], None]
    ) -> None:
        """Read the data folder's database in a thread of its own, then show what was found."""
        try:
            with closing(connect_read_only(folder / DATABASE_NAME)) as database:
                found = read(database)
        except (FieldcamError, OSError) as error:
            told = partial(self.hear, News(str(error), bad=True))
        else:
            told = partial(show, found)
        if not get_current_worker().is_cancelled:
            self.post_message(LookedUp(told))

    def on_looked_up(self, message: LookedUp) -> None:
        message.show()

    @property
    def too_small(self) -> bool:
        """Nothing of the screen is to be seen but a sentence that says so."""
        (columns, rows), (least_columns, least_rows) = self.app.size, self.least
        return columns < least_columns or rows < least_rows

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """No key does what cannot be seen."""
        return not self.too_small

    def on_resize(self, event: Resize) -> None:
        (columns, rows), (least_columns, least_rows) = event.size, self.least
        self.set_class(self.too_small, "-small")
        self.refresh_bindings()
        self.query_one("#small", Static).update(
            f"fieldcam needs a window of {least_columns}x{least_rows};"
            f" this one is {columns}x{rows}."
        )


class Page(FullScreen):
    """A full screen of the walk; `show` is called with each new state."""

    pictures: PictureStyle = PictureStyle.BLOCKS
    """How pictures are shown; to be set before the screen is opened."""

    def __init__(self, walk: Walk, state: WalkState | None = None) -> None:
        """`state` is the last one, where one is known already."""
        super().__init__()
        self.walk = walk
        self.state = state
        self.looks_at: int | None = None
        """The tag that was asked for, here or on the screen before; None: the walk's."""

    def on_mount(self) -> None:
        if self.state is not None:
            self.show(self.state)

    def on_resize(self, event: Resize) -> None:
        """Besides what every screen does."""
        was_wide = self.has_class("-wide")
        self.set_class(event.size.width >= WIDE, "-wide")
        if self.has_class("-wide") and not was_wide and self.state is not None:
            self.show(self.state)

    def show(self, state: WalkState) -> None:
        """Show this state."""
        self.state = state
        self.show_bar(state.block, state.day, state.simulated, state.free_bytes)
