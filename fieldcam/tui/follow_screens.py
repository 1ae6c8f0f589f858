"""The screens of a follower: what the app shows, without a key that changes anything."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.widgets import Static

from fieldcam.session.following import Sight, Unseen
from fieldcam.tui.banner_view import BannerView
from fieldcam.tui.buttons import Key, big_button
from fieldcam.tui.lights_view import LightsView
from fieldcam.tui.page import Frame
from fieldcam.tui.picture_view import PictureView
from fieldcam.tui.sizes_view import SizesView
from fieldcam.tui.telling import Banner, Tone, banner, counted, progress

THEME = Key("DAY/NIGHT  D", "switch_theme", Tone.PLAIN)


class FollowScreen(Frame):
    """Upright on a phone, or lying as a terminal does."""

    CSS_PATH = [  # noqa: RUF012 (Textual's own form)
        "walk_screen.tcss",
        "follow_screens.tcss",
    ]
    HORIZONTAL_BREAKPOINTS = [(0, "-upright"), (80, "-wide")]  # noqa: RUF012 (Textual's own form)
    least: ClassVar[tuple[int, int]] = (44, 20)

    def show(self, sight: Sight) -> None:
        """Show this state, or why there is none."""

    async def action_switch_theme(self) -> None:
        """The button's; the key is the app's."""
        await self.run_action("app.switch_theme")


class FollowWalk(FollowScreen):
    """The Walk screen's findings."""

    TITLE = "Walk"

    def body(self) -> ComposeResult:
        yield BannerView(id="banner")
        yield LightsView(id="lights")
        with Horizontal(id="findings"):
            yield PictureView(id="picture")
            yield SizesView(id="sizes")
        yield Static(id="progress", markup=False)
        with Horizontal(id="keys"):
            yield big_button(THEME)

    def show(self, sight: Sight) -> None:
        if isinstance(sight, Unseen):
            self.query_one(BannerView).show(unseen(sight), "")
            self.query_one("#findings").visible = False
            self.query_one(LightsView).show(None)
            self.query_one("#progress", Static).update("")
            return
        self.show_bar(sight.block, sight.day, sight.simulated, sight.free_bytes)
        self.query_one(BannerView).show(banner(sight), counted(sight))
        self.query_one(LightsView).show(sight.shown)
        self.query_one("#findings").visible = True
        self.query_one(PictureView).show(sight.shown)
        self.query_one(SizesView).show(sight)
        self.query_one("#progress", Static).update(progress(sight))


def unseen(sight: Unseen) -> Banner:
    """In place of a verdict."""
    return Banner("NO DATA", "query", Tone.ASK, sight.sentence)
