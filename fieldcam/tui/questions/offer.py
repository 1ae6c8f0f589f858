"""What is asked where there is neither a camera nor any data."""

from __future__ import annotations

from enum import StrEnum
from pathlib import PurePath
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Static

from fieldcam.tui.ending import EndableApp, ended_by_signals
from fieldcam.tui.themes import DARK
from fieldcam.tui.widgets.buttons import BigButton


class Choice(StrEnum):
    """What the operator wants to see."""

    DEMO = "demo"
    SET_UP = "set_up"


class Offer(EndableApp[Choice]):
    """One key chooses; None: neither."""

    CSS_PATH: ClassVar[list[str | PurePath]] = ["../buttons.tcss", "offer.tcss"]
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter,d", "choose('demo')", "Demo"),
        Binding("e", "choose('set_up')", "Set up"),
        Binding("q,escape,ctrl+c", "quit", "End"),
    ]

    def __init__(self, no_camera: str) -> None:
        """`no_camera` is the sentence that says so."""
        super().__init__()
        self._no_camera = no_camera
        self.register_theme(DARK)
        self.theme = DARK.name

    def compose(self) -> ComposeResult:
        with Vertical(id="offer"):
            yield Static(f"{self._no_camera}\n\nThere is no data here yet.", markup=False)
            with Horizontal(id="choices"):
                yield BigButton("DEMO  Enter", action="app.choose('demo')", classes="-good")
                yield BigButton("SET UP  E", action="app.choose('set_up')", classes="-busy")
                yield BigButton("END  Q", action="app.quit")
            yield Static("The demo walks a simulated orchard in a folder of its own.")

    def action_choose(self, choice: str) -> None:
        self.exit(Choice(choice))


def offered(no_camera: str) -> Choice | None:
    """Ask; raises Stopped where a signal ended it."""
    offer = Offer(no_camera)
    with ended_by_signals(offer):
        choice = offer.run()
    offer.raise_defect()
    return choice
