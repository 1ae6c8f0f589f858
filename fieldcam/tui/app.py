"""The app: holds the walk, the last state and the log, and passes on what it hears."""

from __future__ import annotations

import asyncio
import signal
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from datetime import datetime
from functools import partial
from typing import ClassVar

from textual.app import App, SystemCommand
from textual.binding import Binding, BindingType
from textual.command import CommandPalette
from textual.screen import Screen
from textual.scrollbar import ScrollBar, ScrollBarRender

from fieldcam.models import Models
from fieldcam.session import events
from fieldcam.session.automatic import Automatic, accepted_since
from fieldcam.session.commands import Walk
from fieldcam.session.state import WalkState
from fieldcam.tui import themes
from fieldcam.tui.aim_screen import AimScreen
from fieldcam.tui.asking import AskYes
from fieldcam.tui.block_screen import BlockScreen
from fieldcam.tui.cluster_screen import ClusterScreen
from fieldcam.tui.device_screen import DeviceScreen
from fieldcam.tui.help_screen import HelpScreen
from fieldcam.tui.learning import LearnKey
from fieldcam.tui.log_screen import LogScreen
from fieldcam.tui.looks import Look
from fieldcam.tui.messages import Heard
from fieldcam.tui.news import News, news
from fieldcam.tui.page import Page
from fieldcam.tui.remote import VARIABLE, shutter_keys
from fieldcam.tui.route_screen import RouteScreen
from fieldcam.tui.sound import Silence, Sound
from fieldcam.tui.walk_screen import WalkScreen

LOG_LINES = 500
USUAL_LOOK = Look()


class PlainBar(ScrollBarRender):
    """Ends at whole cells: the Linux console's fonts have no eighths of one."""

    VERTICAL_BARS: ClassVar[list[str]] = [" "]
    HORIZONTAL_BARS: ClassVar[list[str]] = [" "]


ScrollBar.renderer = PlainBar


class FieldcamApp(App[None]):
    """`start` makes the walk, which tells what happens to the listener it is given."""

    TITLE = "fieldcam"
    CSS_PATH = "page.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("o", "route", "Route"),
        Binding("v", "cluster", "Cluster"),
        Binding("b", "block", "Block"),
        Binding("i", "device", "Device"),
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
        tricks: Mapping[str, Callable[[], str]] | None = None,
        models: Models | None = None,
        look: Look = USUAL_LOOK,
    ) -> None:
        """`lines` are what the log begins with, such as what the start-up check found.

        `tricks` are more commands of the palette by their names; each says what it did.
        """
        # Without colours the terminal's own are left alone; bold and reverse stay.
        super().__init__(ansi_color=None if look.colour else True)
        self._start = start
        self._look = look
        self._models = models
        self.sound: Sound = Silence() if sound is None else sound
        self.walk: Walk | None = None
        self.state: WalkState | None = None
        self.automatic = Automatic()
        self._tricks = tricks or {}
        self.log_lines: deque[str] = deque(lines, maxlen=LOG_LINES)
        for theme in themes.ALL:
            self.register_theme(theme)
        self.theme = look.theme

    def on_mount(self) -> None:
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGHUP):
            # Textual would be killed by them and leave the terminal as it is.
            loop.add_signal_handler(number, self.exit)
        self.set_keymap({"shoot": shutter_keys()})
        self.walk = self._start(self._hear)
        self.push_screen(self._dressed(WalkScreen(self.walk)))

    def on_heard(self, message: Heard) -> None:
        event = message.event
        if isinstance(event, events.Changed):
            self._show(event.state)
        elif isinstance(event, events.Doubted):
            self._ask(event)
        elif isinstance(event, events.Previewed):
            if isinstance(self.screen, AimScreen):
                self.screen.look(event)
        elif (told := news(event)) is not None:
            self._tell(told)
        if isinstance(event, events.Saved | events.StorageTrouble):
            self._leave_aim()

    def action_route(self) -> None:
        self._open(RouteScreen)

    def action_aim(self) -> None:
        if not isinstance(self.screen, AimScreen):
            self._open(lambda walk, state: AimScreen(walk, state, self.automatic))

    def action_learn_key(self) -> None:
        self.push_screen(LearnKey(), self._learned)

    def action_cluster(self) -> None:
        self._open(ClusterScreen)

    def action_block(self) -> None:
        self._open(BlockScreen)

    def action_device(self) -> None:
        self._open(lambda walk, state: DeviceScreen(walk, state, self._models))

    def action_log(self) -> None:
        self._open(lambda walk, state: LogScreen(walk, state, self.log_lines))

    def action_help(self) -> None:
        self.push_screen(HelpScreen())

    def action_switch_theme(self) -> None:
        self.theme = themes.OTHER.get(self.theme, self._look.theme)
        if self.state is not None:
            self._show(self.state)

    def action_restart_analysis(self) -> None:
        if self.walk is not None:
            self.walk.restart_analysis()

    def action_command_palette(self) -> None:
        """Textual's own, with a prompt that every font can show."""
        if isinstance(self.screen, Page):
            self.push_screen(CommandPalette(placeholder="Search for commands"))

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        yield SystemCommand("Route", "Trees and clusters; go to any", self.action_route)
        yield SystemCommand("Aim", "What the camera sees", self.action_aim)
        learn = "A button of yours takes the picture"
        yield SystemCommand("Learn a remote's key", learn, self.action_learn_key)
        for name, trick in self._tricks.items():
            told = partial(self._play, trick)
            yield SystemCommand(name, "Of a camera without hardware", told)
        yield SystemCommand("Cluster", "Pictures and sizes of all days", self.action_cluster)
        yield SystemCommand("Block", "Sizes by day, what is missing", self.action_block)
        device = "Camera, networks, disk, battery, analysis"
        yield SystemCommand("Device", device, self.action_device)
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
        """Over the Walk or Aim screen, to which Escape goes back; never over a question."""
        if self.walk is None or not isinstance(self.screen, Page):
            return
        page = self._dressed(make(self.walk, self.state))
        if isinstance(self.screen, WalkScreen | AimScreen):
            self.push_screen(page)
        else:
            self.switch_screen(page)

    def _leave_aim(self) -> None:
        """What came of the picture is on the Walk screen."""
        if isinstance(self.screen, AimScreen):
            self.pop_screen()

    def _learned(self, key: str | None) -> None:
        if key is not None:
            self.set_keymap({"shoot": shutter_keys(key)})
            self._tell(News(f"{key} takes the picture now. {VARIABLE}={key} keeps it."))

    def _play(self, trick: Callable[[], str]) -> None:
        self._tell(News(trick()))

    def _dressed(self, page: Page) -> Page:
        page.pictures = self._look.pictures
        return page

    def _show(self, state: WalkState) -> None:
        before, self.state = self.state, state
        for screen in self.screen_stack:
            if isinstance(screen, Page) and screen.is_mounted:
                screen.show(state)
        if self.automatic.on and before is not None and accepted_since(before, state):
            self.action_aim()

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
