"""The Cluster screen: every picture of one cluster, day by day, and what was said about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from sqlite_utils import Database
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Static

from fieldcam.growth.agreement import Agreement, agreement
from fieldcam.session.commands import (
    AcceptPicture,
    AddByHand,
    CrownKing,
    GoTo,
    NameFruit,
    UndoFruit,
    Walk,
)
from fieldcam.session.over_days.days import ClusterDay, cluster_days
from fieldcam.session.state import Shown, WalkState
from fieldcam.session.viewing import shown_picture
from fieldcam.store.objects import Objects
from fieldcam.store.queries.calipers import caliper_sizes, measured_twice, named_fruitlets
from fieldcam.store.queries.history import CaptureRecord
from fieldcam.store.queries.said import StandingWord, said
from fieldcam.store.readings import stored_reading
from fieldcam.store.rows.row import EntryId
from fieldcam.tui.questions import answers
from fieldcam.tui.questions.asking import AskText, AskYes
from fieldcam.tui.questions.forms import AskForm, Field
from fieldcam.tui.screens.cluster_page import (
    NO_CLUSTERS,
    ONWARD,
    ClusterPage,
    block_tags,
    tag_to_show,
)
from fieldcam.tui.text.fruit_words import Called, agreement_line, called
from fieldcam.tui.text.history_words import picture_heading, picture_line, word_line
from fieldcam.tui.text.news import News
from fieldcam.tui.widgets.days_view import DaysView, Past
from fieldcam.tui.widgets.fitting_picture import picture_view
from fieldcam.tui.widgets.picture_view import PictureView
from fieldcam.tui.widgets.sizes_view import SizesView
from fieldcam.tui.widgets.sketch import Still, letter_in
from fieldcam.words import number_of

NO_PICTURE = "There is no picture of this cluster yet."
NO_OTHER = "There is no other picture of this cluster."
DECIDED = "This picture is decided on already."
NO_FRUITLET = "No fruitlet of this cluster was found in this picture."


@dataclass(frozen=True, slots=True)
class History:
    """What the store knows of the cluster, and the one picture that is shown."""

    tag_id: int | None = None
    """None where the block has no clusters."""
    tags: tuple[int, ...] = ()
    days: tuple[ClusterDay, ...] = ()
    words: tuple[StandingWord, ...] = ()
    shown: Shown | None = None
    names: Mapping[int, Called] = field(default_factory=dict)
    """Of the fruitlets in the picture, with their sizes by caliper."""
    agreement: Agreement | None = None
    """Of camera and calipers, over the block."""

    @property
    def pictures(self) -> tuple[CaptureRecord, ...]:
        return tuple(picture for day in self.days for picture in day.pictures)


class ClusterScreen(ClusterPage):
    """With keys for words on single fruitlets."""

    CSS_PATH = "cluster_screen.tcss"
    TITLE = "Cluster"
    about = "Cluster: every picture of one cluster with its sizes, and who said what when."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,v", "app.pop_screen", "Back", tooltip="Back"),
        Binding(
            "left", "browse(-1)", "Picture", key_display="←→", tooltip="Earlier, later picture"
        ),
        Binding("right", "browse(1)", "Later picture", show=False),
        *ONWARD,
        Binding(
            "up", "choose(-1)", "Fruitlet above", show=False, tooltip="Choose the fruitlet above"
        ),
        Binding(
            "down", "choose(1)", "Fruitlet below", show=False, tooltip="Choose the fruitlet below"
        ),
        Binding("enter", "decide", "Decide", show=False, tooltip="Decide on this picture"),
        Binding("k", "king", "King", show=False, tooltip="King: the chosen one (>)"),
        Binding("m", "add_by_hand", "Add", show=False, tooltip="Measured by hand: add one"),
        Binding("c", "caliper", "Size", tooltip="Caliper size of the chosen one"),
        Binding("t", "app.two_days", "Days", tooltip="Two days: who is who"),
        Binding("u", "undo", "Undo", tooltip="Undo the last size or name"),
        Binding("pageup", "scroll_words(-1)", "Earlier words", show=False, tooltip="Earlier words"),
        Binding("pagedown", "scroll_words(1)", "Later words", show=False, tooltip="Later words"),
    ]

    def __init__(self, walk: Walk, state: WalkState | None = None) -> None:
        super().__init__(walk, state)
        self._history: History | None = None
        self._picture: EntryId | None = None
        """The capture that was chosen; None: the last one."""

    def body(self) -> ComposeResult:
        yield Static(id="heading", markup=False)
        with Horizontal(id="findings"):
            yield picture_view(self.pictures)
            yield SizesView(id="sizes")
        yield Static(id="caption", markup=False)
        yield Static(id="agreement", markup=False)
        with Horizontal(id="past"):
            yield DaysView()
            with Past(id="words"):
                yield Static(id="word-lines", markup=False)
        yield Static(id="said", markup=False)

    def show(self, state: WalkState) -> None:
        super().show(state)
        self._look()

    def action_browse(self, by: int) -> None:
        pictures = () if self._history is None else self._history.pictures
        ids = [picture.id for picture in pictures]
        if len(ids) < 2:
            self.hear(News(NO_OTHER if ids else NO_PICTURE))
            return
        here = ids.index(self._picture) if self._picture in ids else len(ids) - 1
        self._picture = ids[(here + by) % len(ids)]
        self._look()

    def action_choose(self, by: int) -> None:
        self.query_one(SizesView).choose(by)
        self._point()

    def on_picture_view_picked(self, event: PictureView.Picked) -> None:
        self.query_one(SizesView).pick(event.place.fruitlet)
        self._point()

    def action_decide(self) -> None:
        """On Walk, where all that speaks for and against a picture is said."""
        shown, state = self._shown, self.state
        if shown is None or state is None or self.tag_id is None:
            self.hear(News(NO_PICTURE))
        elif shown.record.action is not None:
            self.hear(News(DECIDED))
        elif shown.record.visit != state.route.visit:
            self._ask_to_accept(shown)
        else:
            self.walk.do(GoTo(self.tag_id))
            self.app.pop_screen()

    def _ask_to_accept(self, shown: Shown) -> None:
        """One of an earlier visit, before which nobody stands any more."""

        def answered(yes: bool | None) -> None:
            if yes:
                self.walk.do(AcceptPicture(shown.id))

        reasons = () if shown.reading is None else shown.reading.verdict.reasons
        asked = " ".join(["This picture is of an earlier visit.", *(r.text for r in reasons)])
        self.app.push_screen(AskYes(f"{asked} Does it count?"), answered)

    def action_king(self) -> None:
        if (found := self._chosen()) is not None:
            self.walk.do(CrownKing(found[0].id, found[1]))

    def action_add_by_hand(self) -> None:
        shown = self._shown
        if shown is None:
            self.hear(News(NO_PICTURE))
            return

        def measured(text: str | None) -> None:
            if text:
                self.walk.do(AddByHand(shown.id, float(text)))

        self.app.push_screen(AskText("Its diameter in mm, by caliper:", "number"), measured)

    def action_caliper(self) -> None:
        if (found := self._chosen()) is None or self._history is None:
            return
        shown, fruitlet = found
        known = self._history.names.get(fruitlet)

        def measured(answer: tuple[float | None, str] | None) -> None:
            if answer is not None:
                size_mm, fruit = answer
                self.walk.do(NameFruit(shown.id, fruitlet, fruit, size_mm))

        fields = [
            Field("Diameter in mm, or empty", check=answers.size_mm),
            Field("Its number or name", "" if known is None else known.fruit),
        ]
        question = f"Fruitlet {letter_in(shown, fruitlet)} by caliper:"
        self.app.push_screen(AskForm(question, fields, _measurement), measured)

    def action_undo(self) -> None:
        if self.tag_id is not None:
            self.walk.do(UndoFruit(self.tag_id))

    def action_scroll_words(self, by: int) -> None:
        words = self.query_one("#words", Past)
        words.scroll_relative(y=by * max(1, words.size.height - 1), animate=False)

    def _point(self) -> None:
        """The chosen fruitlet stands out in the picture."""
        shown, chosen = self._shown, self.query_one(SizesView).chosen
        sketch = None if shown is None else Still(shown, chosen)
        self.query_one(PictureView).draw(sketch)

    def _chosen(self) -> tuple[Shown, int] | None:
        """The picture and the fruitlet that stands out in it; says so where there is none."""
        shown, fruitlet = self._shown, self.query_one(SizesView).chosen
        if shown is not None and fruitlet is not None:
            return shown, fruitlet
        self.hear(News(NO_PICTURE if shown is None else NO_FRUITLET))
        return None

    @property
    def _shown(self) -> Shown | None:
        return None if self._history is None else self._history.shown

    def _look(self) -> None:
        state, picture, asked = self.state, self._picture, self.looks_at
        if state is None:
            return
        objects, block = Objects(state.folder), state.route.block

        def read(database: Database) -> History:
            tags = block_tags(database, state)
            tag_id = tag_to_show(asked, state, tags)
            if tag_id is None:
                return History()
            days = cluster_days(database, block, tag_id)
            shown = _shown(database, objects, days, picture)
            sizes, named = caliper_sizes(database, block), named_fruitlets(database, block)
            reading = None if shown is None else shown.record.reading
            pairs = measured_twice(sizes, named)
            return History(
                tag_id,
                tags,
                days,
                said(database, block, tag_id),
                shown,
                {} if reading is None else called(reading.id, sizes, named),
                agreement([p.camera_mm for p in pairs], [p.calipers_mm for p in pairs]),
            )

        self.look_up(state.folder, read, self._found)

    def _found(self, found: History) -> None:
        if self.tag_id != found.tag_id:
            self._picture = None
        self.tag_id, self.tags, self._history = found.tag_id, found.tags, found
        self._write(found)

    @property
    def _heading(self) -> str:
        if self.tag_id is None or self.state is None or self._history is None:
            return NO_CLUSTERS
        stop = self.state.route.stop(self.tag_id)
        days, pictures = len(self._history.days), len(self._history.pictures)
        parts = [
            f"Tag {self.tag_id}",
            "" if stop is None or not stop.tree_label else f"tree {stop.tree_label}",
            f"{number_of(days, 'day')}, {number_of(pictures, 'picture')}",
        ]
        return "   ".join(filter(None, parts))

    def _write(self, history: History) -> None:
        places = {picture.id: n + 1 for n, picture in enumerate(history.pictures)}
        shown = history.shown
        self.query_one("#heading", Static).update(self._heading)
        self.query_one(SizesView).show(
            "" if shown is None else picture_heading(shown.record),
            None if shown is None else shown.record.reading,
            {fruitlet: str(name) for fruitlet, name in history.names.items()},
        )
        self._point()
        measured = agreement_line(history.agreement)
        self.query_one("#agreement", Static).update(measured)
        self.query_one("#agreement").display = bool(measured)
        caption = "" if self.tag_id is None else NO_PICTURE
        if shown is not None:
            caption = picture_line(shown.record, places[shown.id], len(places))
        self.query_one("#caption", Static).update(caption)
        self.query_one(DaysView).show(history.days)
        readings = (picture.reading for picture in history.pictures)
        known = {reading.id: reading for reading in readings if reading is not None}
        newest_first = [word_line(word, places, known) for word in reversed(history.words)]
        self.query_one("#word-lines", Static).update("\n".join(newest_first))


def _measurement(size: str, fruit: str) -> tuple[float | None, str]:
    return answers.size_mm(size), answers.words(fruit)


def _shown(
    database: Database,
    objects: Objects,
    days: tuple[ClusterDay, ...],
    chosen: EntryId | None,
) -> Shown | None:
    """The chosen picture, else the last one, with its whole reading."""
    pictures = [picture for day in days for picture in day.pictures]
    if not pictures:
        return None
    record = next((picture for picture in pictures if picture.id == chosen), pictures[-1])
    reading = None if record.reading is None else stored_reading(database, record.reading.id)
    return shown_picture(database, objects, record, reading)
