"""The Device screen: whether camera, networks, disk, battery and analysis are fit for a walk."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from sqlite_utils import Database
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Static

from fieldcam.calibration.stored_drift import TagSizes, tag_sizes
from fieldcam.models import Models
from fieldcam.session.battery import batteries
from fieldcam.session.commands import RestartAnalysis, Walk
from fieldcam.session.state import WalkState
from fieldcam.store.queries.usage import LastCamera, bytes_per_capture, last_camera, newest_readings
from fieldcam.store.readings import stored_reading
from fieldcam.store.rows.row import EntryId
from fieldcam.store.space import Space
from fieldcam.tui.screens.page import Page
from fieldcam.tui.text.device_words import (
    Disk,
    analysis_facts,
    battery_fact,
    calibration_facts,
    camera_facts,
    disk_fact,
    model_facts,
)

PICTURES = 10
"""The last ones, which the calibration check looks at."""


@dataclass(frozen=True, slots=True)
class Equipment:
    """What the data folder says at once."""

    camera: LastCamera | None
    disk: Disk
    readings: tuple[EntryId, ...]
    """What the calibration check looks at."""


class DeviceScreen(Page):
    """Facts, those that need somebody's hand in another colour and with a mark."""

    CSS_PATH = "device_screen.tcss"
    TITLE = "Device"
    about = "Device: whether camera, calibration, networks, disk and analysis are well."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,i", "app.pop_screen", "Back", tooltip="Back"),
        Binding("r", "restart", "Restart analysis", tooltip="Restart the analysis"),
    ]

    def __init__(
        self, walk: Walk, state: WalkState | None = None, models: Models | None = None
    ) -> None:
        super().__init__(walk, state)
        self._models = models
        self._checked: tuple[EntryId, ...] | None = None
        self._sizes: TagSizes | None = None

    def body(self) -> ComposeResult:
        with VerticalScroll(id="facts"):
            yield Static(id="fact-lines")
        yield Static(id="said", markup=False)

    def show(self, state: WalkState) -> None:
        super().show(state)

        def read(database: Database) -> Equipment:
            return equipment(database, state.folder)

        self.look_up(state.folder, read, lambda found: self._found(state, found))

    def action_restart(self) -> None:
        self.walk.do(RestartAnalysis())

    def _found(self, state: WalkState, found: Equipment) -> None:
        self._write(state, found)
        if found.readings == self._checked:
            return

        def check(database: Database) -> TagSizes:
            # Each takes some 30 ms, so it comes after what is known at once.
            return tag_sizes(stored_reading(database, key) for key in found.readings)

        def show(sizes: TagSizes) -> None:
            self._checked, self._sizes = found.readings, sizes
            self._write(state, found)

        self.look_up(state.folder, check, show)

    def _write(self, state: WalkState, found: Equipment) -> None:
        facts = [
            *camera_facts(state.camera, found.camera, state.camera_notes),
            *calibration_facts(state.uncalibrated, self._sizes),
            *model_facts(self._models),
            disk_fact(found.disk),
            battery_fact(batteries()),
            *analysis_facts(state.analysis),
        ]
        table = Table.grid(padding=(0, 1))
        table.add_column(width=12)
        table.add_column(overflow="fold")
        for fact in facts:
            style = self.app.theme_variables["error"] if fact.bad else ""
            text = f"! {fact.text}" if fact.bad else fact.text
            table.add_row(Text(fact.name, "bold"), Text(text, style))
        self.query_one("#fact-lines", Static).update(table)


def equipment(database: Database, folder: Path) -> Equipment:
    """Without decoding a reading."""
    each, space = bytes_per_capture(database), Space(folder)
    left = None if each is None else space.captures_left(each)
    disk = Disk(space.free_bytes, space.reserve_bytes, left)
    return Equipment(last_camera(database), disk, newest_readings(database, PICTURES))
