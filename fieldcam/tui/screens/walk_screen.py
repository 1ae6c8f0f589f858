"""The Walk screen: one cluster, its picture, its sizes, and what to do with them."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal

from fieldcam.session.commands import (
    Accept,
    AnswerQuestion,
    Command,
    CorrectTag,
    NextTree,
    OtherTarget,
    Retake,
    SecondView,
    Strike,
    Walk,
    WriteNote,
)
from fieldcam.session.over_days.days import cluster_days
from fieldcam.session.state import CameraState, WalkState
from fieldcam.store.rows.judgements import Answer
from fieldcam.tui.questions.asking import AskText
from fieldcam.tui.screens.at_cluster import AtCluster
from fieldcam.tui.text.news import News
from fieldcam.tui.text.telling import banner, counted, not_saved, progress, sizes_heading
from fieldcam.tui.widgets.banner_view import BannerView
from fieldcam.tui.widgets.buttons import BigButtons
from fieldcam.tui.widgets.days_view import DaysView
from fieldcam.tui.widgets.fitting_picture import picture_view
from fieldcam.tui.widgets.lights_view import LightsView
from fieldcam.tui.widgets.picture_view import PictureView
from fieldcam.tui.widgets.sizes_view import SizesView
from fieldcam.tui.widgets.words import Words


class WalkScreen(AtCluster):
    """Each key calls one command of the walk; what came of it is told later."""

    CSS_PATH = "walk_screen.tcss"
    TITLE = "Walk"
    about = (
        "Walk: one cluster. Space takes the picture; once it is saved you may walk on.\n"
        "Enter accepts it. CONFIRM asks why some are missing: F or H; 2 compares days."
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("a", "app.aim", "Aim", tooltip="Aim through the camera"),
        Binding("enter", "accept", "Accept", show=False, tooltip="Accept the picture"),
        Binding("r,backspace", "retake", "Retake", show=False, tooltip="Retake: take it again"),
        Binding("s", "second_view", "2nd view", show=False, tooltip="Second view beside it"),
        Binding("f", "fallen", "Fallen", show=False, tooltip="Fallen: what is missing"),
        Binding("h", "hidden", "Hidden", show=False, tooltip="Hidden: what is missing"),
        Binding("2", "two_days", "Two days", show=False, tooltip="Two days: compare, answer"),
        Binding("t", "correct_tag", "Tag", tooltip="Tag: say which one it is"),
        Binding("c", "other_target", "Target", show=False, tooltip="Target: another cluster"),
        Binding("x", "strike", "Strike", show=False, tooltip="Strike out the chosen one (>)"),
        Binding("n", "note", "Note", tooltip="Note on the picture"),
        Binding("k", "skip", "Skip", tooltip="Skip this cluster today"),
        Binding("u", "undo", "Undo", tooltip="Undo the last decision"),
        Binding("w", "next_tree", "Next tree", show=False, tooltip="On to the next tree"),
        Binding(
            "up", "choose(-1)", "Fruitlet above", show=False, tooltip="Choose the fruitlet above"
        ),
        Binding(
            "down", "choose(1)", "Fruitlet below", show=False, tooltip="Choose the fruitlet below"
        ),
    ]

    def __init__(self, walk: Walk) -> None:
        super().__init__(walk)
        self._unsaved = ""

    def body(self) -> ComposeResult:
        yield BannerView(id="banner")
        yield LightsView(id="lights")
        with Horizontal(id="findings"):
            yield picture_view(self.pictures)
            yield SizesView(id="sizes")
            yield DaysView()
        yield Words(id="said", markup=False)
        yield Words(id="progress", markup=False)
        yield BigButtons(id="buttons")

    def show(self, state: WalkState) -> None:
        super().show(state)
        self._look_back(state)
        if state.camera is CameraState.EXPOSING:
            # The last picture's numbers must not look like those of the next one.
            state = replace(state, shown=None)
        if self._unsaved:
            self.query_one(BannerView).show(not_saved(self._unsaved), "")
        else:
            self.query_one(BannerView).show(banner(state), counted(state))
        self.query_one(LightsView).show(state.shown)
        reading = None if state.shown is None else state.shown.record.reading
        self.query_one(SizesView).show(sizes_heading(state), reading)
        self.query_one(PictureView).show(state.shown, self._chosen)
        self.query_one(BigButtons).show(question=state.missing > 0)
        self.query_one("#progress", Words).update(progress(state))

    def _look_back(self, state: WalkState) -> None:
        """Where there is room for it."""
        block, tag_id, days = state.route.block, state.tag_id, self.query_one(DaysView)
        if not self.has_class("-wide"):
            return
        if tag_id is None:
            days.show(())
            return
        self.look_up(
            state.folder, lambda database: cluster_days(database, block, tag_id), days.show
        )

    def hear(self, told: News) -> None:
        super().hear(told)
        self._unsaved = told.sentence if told.unsaved else ""

    def ask(self, sentence: str, command: Command) -> None:
        """Say at once that a key was heard: the walk answers when its rows are durable."""
        said = self.query_one("#said", Words)
        said.update(sentence)
        said.remove_class("-bad")
        super().ask(sentence, command)

    def action_accept(self) -> None:
        self.ask("Accept …", Accept())

    def action_retake(self) -> None:
        self.ask("Retake …", Retake())

    def action_second_view(self) -> None:
        self.ask("Second view …", SecondView())

    def action_fallen(self) -> None:
        self.ask("Fallen …", AnswerQuestion(Answer.FALLEN))

    def action_hidden(self) -> None:
        self.ask("Hidden …", AnswerQuestion(Answer.HIDDEN))

    async def action_two_days(self) -> None:
        """What helps to answer CONFIRM; the button's too."""
        await self.run_action("app.two_days")

    def action_other_target(self) -> None:
        self.ask("Other target …", OtherTarget())

    def action_strike(self) -> None:
        if (chosen := self._chosen) is not None:
            self.ask("Strike …", Strike(chosen))

    def action_next_tree(self) -> None:
        self.ask("Next tree …", NextTree())

    def action_choose(self, by: int) -> None:
        self.query_one(SizesView).choose(by)
        self._point()

    def on_picture_view_picked(self, event: PictureView.Picked) -> None:
        self.query_one(SizesView).pick(event.place.fruitlet)
        self._point()

    def action_note(self) -> None:
        self.app.push_screen(AskText("A note on this picture:"), self._noted)

    def action_correct_tag(self) -> None:
        if self.state is None or self.state.shown is None:
            self.hear(News("There is no picture of this cluster yet.", bad=True))
            return
        self.app.push_screen(AskText("Which tag is in this picture?", "integer"), self._corrected)

    def _point(self) -> None:
        """The chosen fruitlet stands out in the picture."""
        if self.state is not None:
            self.query_one(PictureView).show(self.state.shown, self._chosen)

    @property
    def _chosen(self) -> int | None:
        """The fruitlet that the list points at."""
        return self.query_one(SizesView).chosen

    def _noted(self, text: str | None) -> None:
        if text is not None:
            self.walk.do(WriteNote(text))

    def _corrected(self, text: str | None) -> None:
        if text:
            self.walk.do(CorrectTag(int(text)))
