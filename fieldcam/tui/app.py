"""The app: holds the walk, the last state and the log, and passes on what it hears."""

from __future__ import annotations

import asyncio
import signal
from collections import deque
from collections.abc import Callable, Iterable
from datetime import datetime
from typing import ClassVar

from textual.app import App, SystemCommand
from textual.binding import Binding, BindingType
from textual.screen import Screen

from fieldcam.session import events
from fieldcam.session.commands import Walk
from fieldcam.session.state import WalkState
from fieldcam.tui.asking import AskYes
from fieldcam.tui.help_screen import HelpScreen
from fieldcam.tui.log_screen import LogScreen
from fieldcam.tui.messages import Heard
from fieldcam.tui.news import News, news
from fieldcam.tui.page import Page
from fieldcam.tui.route_screen import RouteScreen
from fieldcam.tui.sound import Silence, Sound
from fieldcam.tui.themes import DARK, LIGHT, OTHER
from fieldcam.tui.walk_screen import WalkScreen

LOG_LINES = 500


class FieldcamApp(App[None]):
    """`start` makes the walk, which tells what happens to the listener it is given."""

    TITLE = "fieldcam"
    CSS_PATH = "page.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("o", "route", "Route"),
        Binding("l", "log", "Log", show=False),
        Binding("d", "switch_theme", "Day/night", show=False),
        Binding("question_mark", "help", "Help", key_display="?"),
        Binding("q", "quit", "End", show=False),
    ]

    def __init__(
        self,
        start: Callable[[events.Listener], Walk],
        sound: Sound | None = None,
        lines: Iterable[str] = (),
    ) -> None:
        """`lines` are what the log begins with, such as what the start-up check found."""
        super().__init__()
        self._start = start
        self.sound: Sound = Silence() if sound is None else sound
        self.walk: Walk | None = None
        self.state: WalkState | None = None
        self.log_lines: deque[str] = deque(lines, maxlen=LOG_LINES)
        for theme in (DARK, LIGHT):
            self.register_theme(theme)
        self.theme = DARK.name

    def on_mount(self) -> None:
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGHUP):
            # Textual would be killed by them and leave the terminal as it is.
            loop.add_signal_handler(number, self.exit)
        self.walk = self._start(self._hear)
        self.push_screen(WalkScreen(self.walk))

    def on_heard(self, message: Heard) -> None:
        event = message.event
        if isinstance(event, events.Changed):
            self._show(event.state)
        elif isinstance(event, events.Doubted):
            self._ask(event)
        elif (told := news(event)) is not None:
            self._tell(told)

    def action_route(self) -> None:
        self._open(RouteScreen)

    def action_log(self) -> None:
        self._open(lambda walk, state: LogScreen(walk, state, self.log_lines))

    def action_help(self) -> None:
        self.push_screen(HelpScreen())

    def action_switch_theme(self) -> None:
        self.theme = OTHER.get(self.theme, DARK.name)
        if self.state is not None:
            self._show(self.state)

    def action_restart_analysis(self) -> None:
        if self.walk is not None:
            self.walk.restart_analysis()

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        yield SystemCommand("Route", "Trees and clusters; go to any", self.action_route)
        yield SystemCommand("Log", "What happened on this walk", self.action_log)
        yield SystemCommand("Help", "All keys", self.action_help)
        yield SystemCommand("Day or night", "The other colours", self.action_switch_theme)
        again = "Start the analysis again"
        yield SystemCommand(again, "After it was given up", self.action_restart_analysis)
        yield SystemCommand("End", "End the walk; it resumes here", self.exit)

    def _hear(self, event: events.LiveEvent) -> None:
        """In the walk's threads, where nothing else of the app may be touched."""
        self.post_message(Heard(event))

    def _open(self, make: Callable[[Walk, WalkState | None], Page]) -> None:
        """Only over the Walk screen, to which Escape goes back."""
        if self.walk is not None and isinstance(self.screen, WalkScreen):
            self.push_screen(make(self.walk, self.state))

    def _show(self, state: WalkState) -> None:
        self.state = state
        for screen in self.screen_stack:
            if isinstance(screen, Page) and screen.is_mounted:
                screen.show(state)

    def _ask(self, doubt: events.Doubted) -> None:
        def answered(yes: bool | None) -> None:
            if yes:
                doubt.insist()

        self.push_screen(AskYes(doubt.sentence), answered)

    def _tell(self, told: News) -> None:
        self.log_lines.append(f"{datetime.now():%H:%M:%S}  {told.sentence}")
        if told.tune is not None:
            self.sound.play(told.tune)
        for screen in self.screen_stack:
            if isinstance(screen, Page):
                screen.hear(told)
