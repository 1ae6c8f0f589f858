"""Opens each screen over the Walk screen, and dresses it for this terminal."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable

from fieldcam.models import Models
from fieldcam.session.aim.automatic import Automatic
from fieldcam.session.commands import Refresh, Walk
from fieldcam.session.state import WalkState
from fieldcam.tui.ending import EndableApp
from fieldcam.tui.keys import key_commands
from fieldcam.tui.looks import Look
from fieldcam.tui.screens.aim_screen import AimScreen
from fieldcam.tui.screens.block_screen import BlockScreen
from fieldcam.tui.screens.cluster_screen import ClusterScreen
from fieldcam.tui.screens.device_screen import DeviceScreen
from fieldcam.tui.screens.growth_screen import GrowthScreen, KnownBlocks
from fieldcam.tui.screens.help_screen import HelpScreen
from fieldcam.tui.screens.log_screen import LogScreen
from fieldcam.tui.screens.page import FullScreen, Page
from fieldcam.tui.screens.route_screen import RouteScreen
from fieldcam.tui.screens.setup_screen import SetUpScreen
from fieldcam.tui.screens.two_days_screen import TwoDaysScreen
from fieldcam.tui.screens.walk_screen import WalkScreen

LOG_LINES = 500


class OpeningApp(EndableApp[None]):
    """An app of screens over a walk; which walk that is, and what it tells, is another's."""

    def __init__(self, look: Look, models: Models | None, lines: Iterable[str]) -> None:
        # Without colours the terminal's own are left alone; bold and reverse stay.
        super().__init__(ansi_color=None if look.colour else True)
        self._look, self._models = look, models
        self.walk: Walk | None = None
        self.state: WalkState | None = None
        self.automatic = Automatic()
        self.log_lines: deque[str] = deque(lines, maxlen=LOG_LINES)
        self._known: KnownBlocks = {}
        """What the Growth screen has followed so far."""

    def action_route(self) -> None:
        self.open_page(RouteScreen)

    def action_aim(self) -> None:
        if not isinstance(self.screen, AimScreen):
            self.open_page(lambda walk, state: AimScreen(walk, state, self.automatic))

    def action_cluster(self) -> None:
        self.open_page(ClusterScreen)

    def action_two_days(self) -> None:
        over_walk = isinstance(self.screen, WalkScreen)
        self.open_page(lambda walk, state: TwoDaysScreen(walk, state, over_walk))

    def action_block(self) -> None:
        self.open_page(BlockScreen)

    def action_growth(self) -> None:
        self.open_page(lambda walk, state: GrowthScreen(walk, state, self._known))

    def action_device(self) -> None:
        self.open_page(lambda walk, state: DeviceScreen(walk, state, self._models))

    def action_log(self) -> None:
        self.open_page(lambda walk, state: LogScreen(walk, state, self.log_lines))

    def action_help(self) -> None:
        """What the screen that is open is for, and its keys."""
        screen = self.screen
        about = screen.about if isinstance(screen, FullScreen) else ""
        self.push_screen(HelpScreen(about, key_commands(screen)))

    def open_page(self, make: Callable[[Walk, WalkState | None], Page]) -> None:
        """Over the Walk or Aim screen, to which Escape goes back; never over a question."""
        if isinstance(self.screen, SetUpScreen):
            self.back_to_walk()
        if self.walk is None or not isinstance(self.screen, Page):
            return
        page = self.dressed(make(self.walk, self.state))
        page.looks_at = self.screen.looks_at
        if isinstance(self.screen, WalkScreen | AimScreen):
            self.push_screen(page)
        else:
            self.switch_screen(page)

    def back_to_walk(self) -> None:
        while self.walk is not None and not isinstance(self.screen, WalkScreen):
            self.pop_screen()
        if self.walk is not None:
            self.walk.do(Refresh())

    def leave_aim(self) -> None:
        """What came of the picture is on the Walk screen."""
        if isinstance(self.screen, AimScreen):
            self.pop_screen()

    def dressed(self, page: Page) -> Page:
        page.pictures = self._look.pictures
        return page

    @property
    def frames(self) -> list[FullScreen]:
        """Those that can be filled: one that is opened while the app ends gets no widgets."""
        found = [screen for screen in self.screen_stack if isinstance(screen, FullScreen)]
        return [frame for frame in found if frame.is_mounted and frame.children]
