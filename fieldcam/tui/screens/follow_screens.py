"""The screens of a follower: what the app shows, without a key that changes anything."""

from __future__ import annotations

from pathlib import PurePath
from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Static

from fieldcam.session.aim.automatic import Automatic
from fieldcam.session.events import Previewed
from fieldcam.session.following import NothingToFollow
from fieldcam.session.state import WalkState
from fieldcam.tui.looks import PictureStyle
from fieldcam.tui.screens.page import FullScreen
from fieldcam.tui.text.aim_telling import aim_banner
from fieldcam.tui.text.telling import Banner, Tone, banner, counted, progress, sizes_heading
from fieldcam.tui.widgets.banner_view import BannerView
from fieldcam.tui.widgets.buttons import Key, big_button
from fieldcam.tui.widgets.cues_view import CuesView
from fieldcam.tui.widgets.fitting_picture import picture_view
from fieldcam.tui.widgets.lights_view import LightsView
from fieldcam.tui.widgets.picture_view import PictureView
from fieldcam.tui.widgets.preview_view import PreviewView
from fieldcam.tui.widgets.range_view import RangeView
from fieldcam.tui.widgets.sizes_view import SizesView

TO_AIM = Key("AIM  A", "other_screen", Tone.PLAIN)
TO_WALK = Key("WALK  A", "other_screen", Tone.PLAIN)
THEME = Key("DAY/NIGHT  D", "switch_theme", Tone.PLAIN)


class FollowScreen(FullScreen):
    """Upright on a phone, or lying as a terminal does."""

    CSS_PATH: ClassVar[list[str | PurePath]] = [
        "walk_screen.tcss",
        "aim_screen.tcss",
        "follow_screens.tcss",
    ]
    HORIZONTAL_BREAKPOINTS = [(0, "-upright"), (80, "-lying")]  # noqa: RUF012 (Textual's own form)
    least: ClassVar[tuple[int, int]] = (44, 20)
    pictures = PictureStyle.BLOCKS
    other: ClassVar[Key]
    """The button that leads to the other screen."""

    def __init__(self, sight: WalkState | NothingToFollow, preview: Previewed | None) -> None:
        super().__init__()
        self._first = sight, preview

    def on_mount(self) -> None:
        self.show(*self._first)

    def body(self) -> ComposeResult:
        yield from self.findings()
        yield Static(id="progress", markup=False)
        with Horizontal(id="keys"):
            yield from map(big_button, (self.other, THEME))

    def findings(self) -> ComposeResult:
        """What this screen has to say."""
        return ()

    def show(self, sight: WalkState | NothingToFollow, preview: Previewed | None) -> None:
        """Show this state, or why there is none; `preview` is None while nobody aims."""
        if isinstance(sight, WalkState):
            self.show_bar(sight.block, sight.day, sight.simulated, sight.free_bytes)
        words = progress(sight) if isinstance(sight, WalkState) else ""
        self.query_one("#progress", Static).update(words)

    async def action_other_screen(self) -> None:
        """The button's; the key is the app's."""
        await self.run_action("app.other_screen")

    async def action_switch_theme(self) -> None:
        """The button's; the key is the app's."""
        await self.run_action("app.switch_theme")


class FollowWalk(FollowScreen):
    """The Walk screen's findings."""

    TITLE = "Walk"
    other = TO_AIM

    def findings(self) -> ComposeResult:
        yield BannerView(id="banner")
        yield LightsView(id="lights")
        with Horizontal(id="findings"):
            yield picture_view(self.pictures)
            yield SizesView(id="sizes")

    def show(self, sight: WalkState | NothingToFollow, preview: Previewed | None) -> None:
        super().show(sight, preview)
        walk = sight if isinstance(sight, WalkState) else None
        shown = None if walk is None else walk.shown
        said = unseen(sight) if isinstance(sight, NothingToFollow) else banner(sight)
        self.query_one(BannerView).show(said, "" if walk is None else counted(walk))
        self.query_one(LightsView).show(shown)
        self.query_one(PictureView).show(shown)
        heading = "" if walk is None else sizes_heading(walk)
        reading = None if shown is None else shown.record.reading
        self.query_one(SizesView).show(heading, reading)


class FollowAim(FollowScreen):
    """The Aim screen's cues, while somebody aims."""

    TITLE = "Aim"
    other = TO_WALK

    def findings(self) -> ComposeResult:
        with Horizontal(id="sight"):
            yield PreviewView(self.pictures, id="preview")
            with Vertical(id="cue"):
                yield BannerView(id="next")
                yield RangeView(id="range")
                yield CuesView(id="cues")

    def show(self, sight: WalkState | NothingToFollow, preview: Previewed | None) -> None:
        super().show(sight, preview)
        due = sight.tag_id if isinstance(sight, WalkState) else None
        # A look at the last cluster must not pass for one at this.
        live = preview if preview is not None and due == preview.cue.due else None
        cue = None if live is None else live.cue
        said = (
            unseen(sight)
            if isinstance(sight, NothingToFollow)
            else aim_banner(sight, cue, Automatic())
        )
        self.query_one(BannerView).show(said, "")
        self.query_one(PreviewView).show(None if live is None else live.picture)
        self.query_one(RangeView).show(None if cue is None else cue.range_mm)
        self.query_one(CuesView).show(cue)


def unseen(sight: NothingToFollow) -> Banner:
    """In place of a verdict."""
    return Banner("NO DATA", "query", Tone.ASK, sight.sentence)
