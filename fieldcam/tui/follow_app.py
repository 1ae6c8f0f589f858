"""The app of a follower: a phone's browser, or another terminal; it only looks."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path, PurePath
from typing import ClassVar, Protocol

from textual.binding import Binding, BindingType
from textual.message import Message

from fieldcam.session.events import Previewed
from fieldcam.session.following import Follower, NotAiming, NothingToFollow, Sight
from fieldcam.session.state import WalkState
from fieldcam.tui.ending import EndableApp, ended_by_signals
from fieldcam.tui.screens.follow_screens import FollowAim, FollowScreen, FollowWalk
from fieldcam.tui.themes import DARK, LIGHT, OTHER

ORPHAN_S = 2.0
"""How often it looks whether whoever started it is still there."""


class FollowerTold(Message):
    """The follower told something, in a thread of its own."""

    def __init__(self, sight: Sight) -> None:
        super().__init__()
        self.sight = sight


class Following(Protocol):
    """`session.following.Follower` is one."""

    def close(self) -> None: ...


class FollowApp(EndableApp[None]):
    """`start` makes the follower, which tells what it sees to whom it is given."""

    TITLE = "fieldcam"
    CSS_PATH: ClassVar[list[str | PurePath]] = ["page.tcss", "buttons.tcss"]
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("a", "other_screen", "Aim or Walk"),
        Binding("d", "switch_theme", "Day/night"),
        Binding("q", "quit", "End"),
    ]

    def __init__(self, start: Callable[[Callable[[Sight], None]], Following]) -> None:
        super().__init__()
        self._start, self._starter = start, os.getppid()
        self._follower: Following | None = None
        self._sight: WalkState | NothingToFollow = NothingToFollow("Looking for the walk.")
        self._preview: Previewed | None = None
        for theme in (DARK, LIGHT):
            self.register_theme(theme)
        self.theme = DARK.name

    def on_mount(self) -> None:
        self.set_interval(ORPHAN_S, self._end_with_parent)
        self.push_screen(FollowWalk(self._sight, self._preview))
        self._follower = self._start(self._told)

    def on_unmount(self) -> None:
        if self._follower is not None:
            self._follower.close()

    def on_follower_told(self, message: FollowerTold) -> None:
        match message.sight:
            case Previewed() as preview:
                began, self._preview = self._preview is None, preview
                self._turn_to(FollowAim) if began else self._show()
            case NotAiming():
                self._preview = None
                self._turn_to(FollowWalk)
            case sight:
                self._sight = sight
                self._show()

    def action_other_screen(self) -> None:
        self._turn_to(FollowWalk if isinstance(self.screen, FollowAim) else FollowAim)

    def action_switch_theme(self) -> None:
        self.theme = OTHER.get(self.theme, DARK.name)
        # Only then does Textual know the theme's colours, of which bars are drawn.
        self.call_next(self._show)

    def _told(self, sight: Sight) -> None:
        """In the follower's thread."""
        self.post_message(FollowerTold(sight))

    def _turn_to(self, kind: type[FollowScreen]) -> None:
        # Not waited for, since the screen that goes may have asked for it.
        self.switch_screen(kind(self._sight, self._preview))
        self.call_after_refresh(self._show)

    def _show(self) -> None:
        if isinstance(self.screen, FollowScreen) and self.screen.is_mounted:
            self.screen.show(self._sight, self._preview)

    def _end_with_parent(self) -> None:
        """A browser's server that was killed leaves nobody to tell this to."""
        if os.getppid() != self._starter:
            self.exit()


def follow(data: Path) -> None:
    """Show the walk in this terminal, or in the browser that this process was started for."""
    app = FollowApp(partial(Follower, data))
    with ended_by_signals(app):
        app.run()
    app.raise_defect()
