"""The app: holds the walk, the last state and the log, and passes on what it hears."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from datetime import date, datetime
from pathlib import PurePath
from typing import ClassVar

from textual import work
from textual.app import SystemCommand
from textual.binding import Binding, BindingType
from textual.command import CommandPalette
from textual.events import Key
from textual.screen import Screen
from textual.scrollbar import ScrollBar

from fieldcam.errors import StorageError
from fieldcam.models import Models
from fieldcam.session import events
from fieldcam.session.aim.automatic import Automatic, accepted_since
from fieldcam.session.commands import RestartAnalysis, Walk
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.session.state import WalkState
from fieldcam.store.rows.row import EntryId
from fieldcam.tui import themes
from fieldcam.tui.looks import Look
from fieldcam.tui.messages import Heard, WalkEnded
from fieldcam.tui.opening import OpeningApp
from fieldcam.tui.palette import palette_commands
from fieldcam.tui.questions.asking import AskYes, Notice
from fieldcam.tui.questions.day_questions import DayQuestions
from fieldcam.tui.questions.doubts import Doubts
from fieldcam.tui.questions.learning import LearnKey
from fieldcam.tui.questions.setup_questions import Questions, carried_out
from fieldcam.tui.remote import VARIABLE, shutter_keys
from fieldcam.tui.screens.aim_screen import AimScreen
from fieldcam.tui.screens.page import FullScreen, Page
from fieldcam.tui.screens.setup_screen import SetUpScreen
from fieldcam.tui.screens.walk_screen import WalkScreen
from fieldcam.tui.sound import Silence, Sound
from fieldcam.tui.text.news import News, news
from fieldcam.tui.trick import Trick
from fieldcam.tui.widgets.plain_bar import PlainBar

HOW_TO_END = "Q ends the walk, Ctrl+Q from anywhere; started again, it goes on here."
END = "End the walk? Started again, it goes on here."
OF_THE_WALK = (
    "route",
    "aim",
    "cluster",
    "two_days",
    "block",
    "growth",
    "device",
    "log",
    "restart_analysis",
)
WITHOUT_ROOM = ("quit", "end", "help", "help_quit")
CALENDAR_EVERY_S = 60.0
USUAL_LOOK = Look()
ScrollBar.renderer = PlainBar


class FieldcamApp(OpeningApp):
    """`start` makes the walk, which tells what happens to the listener it is given."""

    TITLE = "fieldcam"
    CSS_PATH: ClassVar[list[str | PurePath]] = ["page.tcss", "buttons.tcss"]
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("o", "route", "Route", tooltip="Route: go to any cluster"),
        Binding("v", "cluster", "Cluster", tooltip="Cluster: pictures of all days"),
        Binding("b", "block", "Block", tooltip="Block: sizes, what is missing"),
        Binding("i", "device", "Device", tooltip="Device: camera, disk, networks"),
        Binding("e", "set_up", "Set-up", show=False, tooltip="Set-up: block, route, sprays"),
        Binding("l", "log", "Log", show=False, tooltip="Log: what happened"),
        Binding(
            "d", "switch_theme", "Day/night", show=False, tooltip="Theme: day or night colours"
        ),
        Binding(
            "question_mark",
            "help",
            "Help",
            key_display="?",
            tooltip="Help: the keys of this screen",
        ),
        Binding("q", "end", "Quit", show=False, tooltip="Quit; it resumes here"),
        Binding("ctrl+q", "quit", "Quit", show=False, tooltip="Quit at once", priority=True),
    ]

    def __init__(
        self,
        start: Callable[[events.Listener], Walk],
        sound: Sound | None = None,
        lines: Iterable[str] = (),
        tricks: Sequence[Trick] = (),
        models: Models | None = None,
        look: Look = USUAL_LOOK,
        setup: SetUp | None = None,
        remember: Callable[[str], None] = lambda theme: None,
    ) -> None:
        """`lines` are what the log begins with, such as what the start-up check found.

        `tricks` are more commands of the palette.
        With a `setup`, `start` makes the walk of its visit. `remember` keeps the theme that
        was chosen.
        """
        super().__init__(look, models, lines)
        self._start, self._setup, self._remember = start, setup, remember
        self._walked: tuple[EntryId | None, float | None] = (None, None)
        self.sound: Sound = Silence() if sound is None else sound
        self._doubts = Doubts(self, self._tell)
        self._days = (
            None if setup is None else DayQuestions(self, setup, self._open_visit, self._tell)
        )
        self._first_news: News | None = None
        """What the next walk begins with."""
        self._tricks = tuple(tricks)
        for theme in themes.ALL:
            self.register_theme(theme)
        self.theme = look.theme

    def on_mount(self) -> None:
        if self._days is not None:
            self.set_interval(CALENDAR_EVERY_S, self._look_at_the_calendar)
        self.set_keymap({"shoot": shutter_keys()})
        if self._setup is None or self._setup.visit is not None:
            self._begin_walk()
        else:
            self.push_screen(SetUpScreen(self._setup))
            if self._setup.block is not None:
                self.action_walk()
        if self.log_lines:
            self.push_screen(Notice(self.log_lines))

    def on_key(self, event: Key) -> None:
        """A letter that nothing else took means the same with Shift or Caps Lock."""
        if event.character is not None and event.character.isalpha() and event.character.isupper():
            event.stop()
            self.simulate_key(event.character.lower())

    def on_walk_ended(self) -> None:
        self._begin_walk()

    def on_heard(self, message: Heard) -> None:
        event = message.event
        if isinstance(event, events.Changed):
            self._show(event.state)
        elif isinstance(event, events.Doubted):
            self._doubts.ask(event, self.state)
        elif isinstance(event, events.DayDoubted):
            self._ask_once_the_day_is_over()
        elif isinstance(event, events.Previewed):
            if isinstance(self.screen, AimScreen):
                self.screen.look(event)
        elif (told := news(event, self.state)) is not None:
            self._tell(told)
        if isinstance(event, events.Saved | events.StorageTrouble):
            self.leave_aim()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """What belongs to a walk waits for one; a screen without room only ends or helps."""
        screen = self.screen_stack[-1] if self.screen_stack else None
        if isinstance(screen, FullScreen) and screen.too_small:
            return action in WITHOUT_ROOM
        return self.walk is not None or action not in OF_THE_WALK

    def action_set_up(self) -> None:
        """The Set-up screen, from any other one but a question."""
        if self._setup is not None and isinstance(self.screen, Page):
            self.back_to_walk()
            self.push_screen(SetUpScreen(self._setup))

    def action_walk(self) -> None:
        """The walk of the block that is set up; where the day is doubtful it is asked for."""
        setup = self._setup
        if setup is None or self._days is None:
            self.back_to_walk()
        elif setup.block is None:
            self._tell(News("Choose a block first, or make one.", bad=True))
        elif setup.visit is None:
            self._days.before_a_visit()
        elif setup.walked != self._walked:
            self._change_walk()
        else:
            self.back_to_walk()

    def action_learn_key(self) -> None:
        self.push_screen(LearnKey(), self._learned)

    def action_end(self) -> None:
        """Asked about, as its key lies beside others; Ctrl+Q is not."""
        if isinstance(self.screen, FullScreen) and self.screen.too_small:
            self.exit()
        elif isinstance(self.screen, FullScreen):
            self.push_screen(AskYes(END), lambda yes: self.exit() if yes else None)

    def action_switch_theme(self) -> None:
        self.theme = themes.OTHER.get(self.theme, self._look.theme)
        self._remember(self.theme)
        if self.state is not None:
            # Only then does Textual know the theme's colours, of which bars are drawn.
            self.call_next(self._show, self.state)

    def action_restart_analysis(self) -> None:
        if self.walk is not None:
            self.walk.do(RestartAnalysis())

    def action_help_quit(self) -> None:
        """Ctrl+C, which most people press without thinking; on the line of the screen."""
        self._tell(News(HOW_TO_END))

    def action_command_palette(self) -> None:
        """Textual's own, with a prompt that every font can show."""
        if isinstance(self.screen, Page):
            self.push_screen(CommandPalette(placeholder="Search for commands"))

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        return palette_commands(self, screen, self._tricks, self._play)

    def _begin_walk(self) -> None:
        """In place of all screens."""
        while len(self.screen_stack) > 1:
            self.pop_screen()
        self.walk = self._start(self._hear)
        # What it has fired at on another visit is to be taken again.
        self.automatic = Automatic(self.automatic.on)
        self.push_screen(self.dressed(WalkScreen(self.walk)))
        if self._setup is not None:
            self._walked = self._setup.walked
            if self._setup.operator is None:
                Questions(self, self._setup, self._setup.state(), self._change).operator()
        if self._first_news is not None:
            self.call_after_refresh(self._tell, self._first_news)
            self._first_news = None

    def _look_at_the_calendar(self) -> None:
        """The app may be left open over days, with the lid closed; what is typed is let be."""
        if isinstance(self.screen, FullScreen):
            self._ask_once_the_day_is_over()

    def _ask_once_the_day_is_over(self) -> None:
        if self._days is not None:
            self._days.once_the_day_is_over()

    def _open_visit(self, day: date, first_news: News | None = None) -> None:
        """A walk of this day; it begins with the news."""
        if self._setup is None:
            return
        self._first_news = first_news
        try:
            self._setup.open_visit(day)
        except StorageError as error:
            self._hear(events.StorageTrouble(error))
        else:
            self._change_walk()

    @work(thread=True, group="walk")
    def _change_walk(self) -> None:
        """The last walk saves what was asked for first, which may take a moment."""
        if self.walk is not None:
            self.walk.close()
        self.post_message(WalkEnded())

    @work(thread=True, group="set-up")
    def _change(self, change: Callable[[], str]) -> None:
        self._hear(carried_out(change))

    def _hear(self, event: events.LiveEvent) -> None:
        """In the walk's threads, where nothing else of the app may be touched."""
        self.post_message(Heard(event))

    def _learned(self, key: str | None) -> None:
        if key is not None:
            self.set_keymap({"shoot": shutter_keys(key)})
            self._tell(News(f"{key} takes the picture now. {VARIABLE}={key} keeps it."))

    def _play(self, trick: Trick) -> None:
        self._tell(News(trick.play()))

    def _show(self, state: WalkState) -> None:
        before, self.state = self.state, state
        self._doubts.withdraw(state)
        for page in self.frames:
            if isinstance(page, Page):
                page.show(state)
        if self.automatic.on and before is not None and accepted_since(before, state):
            self.action_aim()

    def _tell(self, told: News) -> None:
        self.log_lines.append(f"{datetime.now():%H:%M:%S}  {told.sentence}")
        if told.tune is not None:
            self.sound.play(told.tune)
        for frame in self.frames:
            frame.hear(told)
