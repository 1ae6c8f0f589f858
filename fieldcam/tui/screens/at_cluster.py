"""What the Walk and the Aim screen share: both stand before one cluster."""

from __future__ import annotations

from typing import ClassVar

from textual.binding import Binding, BindingType

from fieldcam.session.commands import Command, Shoot, SkipCluster, Step, UndoLast
from fieldcam.tui.remote import SHOOT
from fieldcam.tui.screens.page import Page

STEPS = {-1: "Previous tag …", 1: "Next tag …"}


class AtCluster(Page):
    """Skipping and undoing have their keys in each screen, as not both show them below."""

    BINDINGS: ClassVar[list[BindingType]] = [
        SHOOT,
        Binding("left", "step(-1)", "Previous tag", show=False, tooltip="The tag before"),
        Binding("right", "step(1)", "Next tag", show=False, tooltip="The next tag"),
    ]

    def ask(self, sentence: str, command: Command) -> None:
        """Give a command; the sentence is for a screen that says at once what it heard."""
        self.walk.do(command)

    def action_shoot(self) -> None:
        self.ask("Taking the picture …", Shoot())

    def action_step(self, by: int) -> None:
        self.ask(STEPS[by], Step(by))

    def action_skip(self) -> None:
        self.ask("Skip …", SkipCluster())

    def action_undo(self) -> None:
        self.ask("Undo …", UndoLast())
