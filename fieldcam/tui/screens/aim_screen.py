"""The Aim screen: what the camera sees, and what to do until the picture can be taken."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.events import ScreenResume, ScreenSuspend

from fieldcam.session.aim.automatic import Automatic
from fieldcam.session.aim.cue import Cue
from fieldcam.session.commands import Shoot, StartPreview, StopPreview, Walk
from fieldcam.session.events import Previewed
from fieldcam.session.state import CameraState, WalkState
from fieldcam.tui.screens.at_cluster import AtCluster
from fieldcam.tui.text.aim_telling import aim_banner, automatic_line
from fieldcam.tui.text.news import News
from fieldcam.tui.text.telling import Tone, progress
from fieldcam.tui.widgets.banner_view import BannerView
from fieldcam.tui.widgets.buttons import CAPTURE, Key, big_button
from fieldcam.tui.widgets.cues_view import CuesView
from fieldcam.tui.widgets.preview_view import PreviewView
from fieldcam.tui.widgets.range_view import RangeView
from fieldcam.tui.widgets.words import Words

AUTOMATIC = Key("AUTOMATIC  G", "automatic", Tone.ASK)
TO_WALK = Key("WALK  Escape", "walk", Tone.PLAIN)


class AimScreen(AtCluster):
    """Looks through the camera as long as nothing covers it."""

    CSS_PATH = "aim_screen.tcss"
    TITLE = "Aim"
    about = "Aim: what the camera sees, and the one thing to do next. READY: take it."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("g", "automatic", "Automatic", tooltip="Automatic firing on or off"),
        Binding("k", "skip", "Skip", show=False, tooltip="Skip this cluster today"),
        Binding("u", "undo", "Undo", show=False, tooltip="Undo the last decision"),
        Binding("escape,a", "walk", "Walk", tooltip="Back to the walk"),
    ]

    def __init__(self, walk: Walk, state: WalkState | None, automatic: Automatic) -> None:
        super().__init__(walk, state)
        self._automatic = automatic
        self._cue: Cue | None = None

    def body(self) -> ComposeResult:
        with Horizontal(id="sight"):
            yield PreviewView(self.pictures, id="preview")
            with Vertical(id="cue"):
                yield BannerView(id="next")
                yield RangeView(id="range")
                yield CuesView(id="cues")
                yield Words(id="automatic", markup=False)
        yield Words(id="heard", markup=False)
        yield Words(id="progress", markup=False)
        with Horizontal(id="keys"):
            yield from map(big_button, (CAPTURE, AUTOMATIC, TO_WALK))

    def on_screen_resume(self, event: ScreenResume) -> None:
        self.walk.do(StartPreview())

    def on_screen_suspend(self, event: ScreenSuspend) -> None:
        self.walk.do(StopPreview())

    def show(self, state: WalkState) -> None:
        moved_on = self.state is None or state.tag_id != self.state.tag_id
        super().show(state)
        if moved_on:
            self.query_one("#heard", Words).update("")
        if moved_on or state.camera is CameraState.LOST:
            # An old picture must not look like a live one.
            self._cue = None
            self.query_one(PreviewView).show(None)
        self.query_one("#progress", Words).update(progress(state))
        self._write(state)

    def look(self, event: Previewed) -> None:
        """A new preview; fires where everything is right and it is to be done by itself."""
        if self.state is None:
            return
        self._cue = event.cue
        self.query_one(PreviewView).show(event.picture)
        self._write(self.state)
        if self._automatic.pull(event.cue, self.state):
            self.walk.do(Shoot())

    def hear(self, told: News) -> None:
        heard = self.query_one("#heard", Words)
        heard.update(told.sentence)
        heard.set_class(told.bad, "-bad")

    def action_automatic(self) -> None:
        self._automatic.switch()
        if self.state is not None:
            self._write(self.state)

    def action_walk(self) -> None:
        self.app.pop_screen()

    def _write(self, state: WalkState) -> None:
        cue = self._cue if self._cue is not None and self._cue.due == state.tag_id else None
        self.query_one(BannerView).show(aim_banner(state, cue, self._automatic), "")
        self.query_one(RangeView).show(None if cue is None else cue.range_mm)
        self.query_one(CuesView).show(cue)
        automatic = self.query_one("#automatic", Words)
        automatic.update(automatic_line(state, self._automatic))
        automatic.set_class(self._automatic.on, "-on")
