"""The app of a follower: a phone's browser, or another terminal; it only looks."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import ClassVar, Protocol

from textual.app import App
from textual.binding import Binding, BindingType
from textual.message import Message

from fieldcam.session.following import Follower, Sight, Unseen
from fieldcam.tui.follow_screens import FollowScreen, FollowWalk
from fieldcam.tui.themes import DARK, LIGHT, OTHER

ORPHAN_S = 2.0
"""How often it looks whether whoever started it is still there."""


class Seen(Message):
    """The follower told something, in a thread of its own."""

    def __init__(self, sight: Sight) -> None:
        super().__init__()
        self.sight = sight


class Following(Protocol):
    """`session.following.Follower` is one."""

    def close(self) -> None: ...


class FollowApp(App[None]):
    """`start` makes the follower, which tells what it sees to whom it is given."""

    TITLE = "fieldcam"
    CSS_PATH = "page.tcss"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("d", "switch_theme", "Day/night"),
        Binding("q", "quit", "End"),
    ]

    def __init__(self, start: Callable[[Callable[[Sight], None]], Following]) -> None:
        super().__init__()
        self._start, self._starter = start, os.getppid()
        self._follower: Following | None = None
        self.sight: Sight = Unseen("Looking for the walk.")
        for theme in (DARK, LIGHT):
            self.register_theme(theme)
        self.theme = DARK.name

    def on_mount(self) -> None:
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, self.exit)
        self.set_interval(ORPHAN_S, self._end_with_parent)
        self.push_screen(FollowWalk())
        self._follower = self._start(self._told)

    def on_unmount(self) -> None:
        if self._follower is not None:
            self._follower.close()

    def on_seen(self, message: Seen) -> None:
        self.sight = message.sight
        self._show()

    def action_switch_theme(self) -> None:
        self.theme = OTHER.get(self.theme, DARK.name)
        self._show()

    def _told(self, sight: Sight) -> None:
        """In the follower's thread."""
        self.post_message(Seen(sight))

    def _show(self) -> None:
        if isinstance(self.screen, FollowScreen):
            self.screen.show(self.sight)

    def _end_with_parent(self) -> None:
        """A browser's server that was killed leaves nobody to tell this to."""
        if os.getppid() != self._starter:
            self.exit()


def follow(data: Path) -> None:
    """Show the walk in this terminal, or in the browser that this process was started for."""
    app = FollowApp(partial(Follower, data))
    app.run()
    if app.return_code:
        raise RuntimeError("The screen ended in the middle.")
