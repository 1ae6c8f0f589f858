"""One cluster on two days side by side: which fruitlet is which, and one key to say better."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from fieldcam.growth.places import Place
from fieldcam.session.commands import MatchFruit, TellMissing, UndoLast, UndoMatch, Walk
from fieldcam.session.state import WalkState
from fieldcam.store.rows.judgements import Answer
from fieldcam.tui.looks import PictureStyle
from fieldcam.tui.screens.cluster_page import NO_CLUSTERS, ONWARD, ClusterPage
from fieldcam.tui.screens.followed import FollowedPictures, followed
from fieldcam.tui.screens.pair_changes import places_of, told_changes
from fieldcam.tui.screens.pair_sketch import TwoStills
from fieldcam.tui.screens.pairs import (
    Pair,
    PairRow,
    pair_lines,
    pair_rows,
    said_word,
    unplaced,
)
from fieldcam.tui.text.news import News
from fieldcam.tui.widgets.days_view import Past
from fieldcam.tui.widgets.fitting_picture import picture_view
from fieldcam.tui.widgets.picture_view import PictureView

LOOKING = "Looking for each fruitlet on the other days."
TOO_FEW = "There are no two accepted pictures of this cluster to compare yet."
HINT = "1-9: the chosen one (>) is this one on the other side; 0: it is not there."
QUESTION = "The chosen one (>): F it has fallen, H it is hidden. R on Walk: take it again."
WITHOUT_ROW = "One without depth is missing, which has no row: F it has fallen, H it is hidden."
NO_OTHER_DAYS = "This cluster has no pictures of other days."
NO_OTHER_VIEWS = "There are no other pictures of these days."
NOTHING = "These two are not one of each picture: a match needs one on either side."
TALL = 36
"""Rows of the window from which on the table gets more room."""


class TwoDaysScreen(ClusterPage):
    """Opens on the last two days."""

    CSS_PATH = "two_days_screen.tcss"
    TITLE = "Two days"
    about = (
        "Two days: a line joins a fruitlet with itself. In a picture that is not decided,\n"
        "F or H says of each missing one what became of it."
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "back", "Back", tooltip="Back"),
        Binding("t,v", "app.cluster", "Cluster", show=False, tooltip="The Cluster screen"),
        Binding("left", "browse(-1)", "Days", key_display="←→", tooltip="The days before, after"),
        Binding("right", "browse(1)", "Later days", show=False),
        *ONWARD,
        Binding("s", "other_views", "Views", tooltip="Other pictures of these days"),
        Binding(
            "up", "choose(-1)", "Fruitlet above", show=False, tooltip="Choose the fruitlet above"
        ),
        Binding(
            "down", "choose(1)", "Fruitlet below", show=False, tooltip="Choose the fruitlet below"
        ),
        Binding("1", "match(1)", "Same", key_display="1-9", tooltip="The chosen (>) is this one"),
        *(Binding(str(n), f"match({n})", "Same", show=False) for n in range(2, 10)),
        Binding("0", "match(0)", "Not there", tooltip="The chosen one is not there"),
        Binding("f", "tell('fallen')", "Fallen", show=False, tooltip="Fallen: the chosen one"),
        Binding("h", "tell('hidden')", "Hidden", show=False, tooltip="Hidden: the chosen one"),
        Binding("u", "undo", "Undo", tooltip="Undo the last match or answer"),
        # There is no room for them below.
        Binding("o", "app.route", "Route", show=False),
        Binding("i", "app.device", "Device", show=False),
    ]

    def __init__(self, walk: Walk, state: WalkState | None = None, over_walk: bool = False) -> None:
        """`over_walk`: it goes back to the Walk screen, else to Cluster."""
        super().__init__(walk, state)
        self._over_walk = over_walk
        self._followed: FollowedPictures | None = None
        self._group = -1
        self._pair = 0
        self._chosen: Place | None = None
        self._heard = ""

    def body(self) -> ComposeResult:
        yield Static(id="heading", markup=False)
        yield picture_view(self.pictures)
        with Past(id="pairs"):
            yield Static(LOOKING, id="pair-lines", markup=False)
        yield Static(HINT, id="hint", markup=False)
        yield Static(id="said", markup=False)

    def show(self, state: WalkState) -> None:
        walked_on = self.state is not None and self.state.tag_id != state.tag_id
        super().show(state)
        if walked_on and self._over_walk and self.looks_at is None and self.app.screen is self:
            # The last answer was given: the walk stands before another cluster.
            self.app.pop_screen()
            return
        self.set_class(self.pictures is PictureStyle.NONE, "-words")
        self.set_class(self.app.size.height >= TALL, "-tall")
        self.look_up(
            state.folder, partial(followed, state, self.looks_at, self._followed), self._found
        )

    def hear(self, told: News) -> None:
        super().hear(told)
        self._heard = told.sentence

    def on_picture_view_picked(self, event: PictureView.Picked) -> None:
        """On the left it chooses, on the right it is the partner."""
        row = next((r for r in self._rows if event.place in (r.one, r.other)), None)
        if row is not None and event.place == row.one:
            self._choose(row)
        elif row is not None:
            self.action_match(row.number)

    def action_browse(self, by: int) -> None:
        groups = () if self._followed is None else self._followed.groups
        if len(groups) > 1:
            self._group, self._pair = (self._group + by) % len(groups), 0
            self._write()
        elif groups:
            self.hear(News(NO_OTHER_DAYS))

    def action_other_views(self) -> None:
        """The pairs of other pictures of the two days."""
        if len(self._pairs) > 1:
            self._pair = (self._pair + 1) % len(self._pairs)
            self._write()
        elif self._pairs:
            self.hear(News(NO_OTHER_VIEWS))

    def action_choose(self, by: int) -> None:
        if rows := self._rows:
            self._choose(rows[(self._row + by) % len(rows)])

    def action_match(self, number: int) -> None:
        pairs = self._pairs
        if not pairs:
            return
        if number and all(row.number != number for row in self._rows):
            self.hear(News(f"There is no fruitlet {number} in these two pictures.", bad=True))
            return
        word = said_word(self._rows, self._number, number, pairs[self._pair])
        if word is None:
            self.hear(News(NOTHING, bad=True))
        else:
            self.walk.do(MatchFruit(word))

    def action_tell(self, answer: str) -> None:
        """Why the later picture does not show the chosen fruitlet."""
        row = next((row for row in self._rows if row.number == self._number), None)
        if not self._pairs or row is None:
            return
        if self._left and not self._untold:
            self.walk.do(TellMissing(self._pairs[self._pair][1].id, None, Answer(answer)))
            return
        if row.one is None or not row.missing:
            self.hear(News(f"{row.number} is not missing: up and down choose one.", bad=True))
            return
        self.walk.do(TellMissing(self._pairs[self._pair][1].id, row.one, Answer(answer)))

    async def action_back(self) -> None:
        await self.run_action("app.pop_screen" if self._over_walk else "app.cluster")

    def action_undo(self) -> None:
        """Of what is told here the newest; the answers are the walk's."""
        if (
            self._followed is not None
            and self._pairs
            and self._followed.told(self._pairs[self._pair])
        ):
            self.walk.do(UndoLast())
        elif self.tag_id is not None:
            self.walk.do(UndoMatch(self.tag_id))

    @property
    def _pairs(self) -> tuple[Pair, ...]:
        groups = () if self._followed is None else self._followed.groups
        return groups[self._group] if groups else ()

    @property
    def _asking(self) -> int:
        """Which of the last days' pairs waits for answers; else the first."""
        left = {} if self._followed is None else self._followed.left
        groups = () if self._followed is None else self._followed.groups
        pairs = groups[-1] if groups else ()
        return next((n for n, pair in enumerate(pairs) if pair[1].id in left), 0)

    @property
    def _left(self) -> int:
        """How many answers the later picture waits for."""
        if self._followed is None or not self._pairs:
            return 0
        return self._followed.left.get(self._pairs[self._pair][1].id, 0)

    @property
    def _untold(self) -> bool:
        """Whether a row is missing and waits for its answer; one without depth has no row."""
        return any(row.missing and row.told is None for row in self._rows)

    @property
    def _rows(self) -> tuple[PairRow, ...]:
        if self._followed is None or not self._pairs:
            return ()
        followed, pair = self._followed, self._pairs[self._pair]
        return pair_rows(followed.tracks, pair, followed.rows.words, followed.told(pair))

    @property
    def _row(self) -> int:
        """Where the chosen fruitlet stands; without one, the first that is asked about."""
        rows = self._rows
        if self._chosen is None:
            asked = (n for n, row in enumerate(rows) if row.missing and row.told is None)
            return next(asked, 0) if self._left else 0
        return next((n for n, r in enumerate(rows) if self._chosen in (r.one, r.other)), 0)

    @property
    def _number(self) -> int:
        """Of the chosen fruitlet; 0 where there is none."""
        return self._rows[self._row].number if self._rows else 0

    def _choose(self, row: PairRow) -> None:
        self._chosen = row.one or row.other
        self._write()

    def _found(self, followed: FollowedPictures | None) -> None:
        before, self._followed = self._followed, followed
        self.tags = () if followed is None else followed.tags
        self.tag_id = None if followed is None else followed.rows.tag_id
        if before is None or followed is None or _days(before) != _days(followed):
            self._group, self._pair = -1, self._asking
        self._pair = min(self._pair, max(0, len(self._pairs) - 1))
        self._write()
        if before is not None and followed is not None and self._pairs:
            self._tell_changes(before, followed)

    def _tell_changes(self, before: FollowedPictures, now: FollowedPictures) -> None:
        """A word on one fruitlet may move others."""
        if before.rows.tag_id != now.rows.tag_id or before.rows.visits != now.rows.visits:
            return
        said = places_of({*before.rows.words} ^ {*now.rows.words})
        told = told_changes(before.tracks, now.tracks, self._pairs[self._pair], said)
        if told:
            self.hear(News(f"{self._heard} {told}".lstrip()))

    def _write(self) -> None:
        if not self._pairs:
            self._say(NO_CLUSTERS if self.tag_id is None else TOO_FEW)
            return
        rows, pair, number = self._rows, self._pairs[self._pair], self._number
        days = " and ".join(f"{shown.record.day:%d %b}" for shown in pair)
        views = f"   pictures {self._pair + 1}/{len(self._pairs)}" if len(self._pairs) > 1 else ""
        asked = pair[1].record.action is None
        left = f"   {self._left} missing to tell" if self._left else ""
        undecided = f"   not decided{left}" if asked else ""
        self.query_one("#heading", Static).update(f"Tag {self.tag_id}   {days}{views}{undecided}")
        alone = unplaced(self._followed.tracks, pair) if self._followed is not None else ((), ())
        self.query_one(PictureView).draw(TwoStills(pair, rows, number, alone))
        lines = pair_lines(rows, pair, number, alone, asked)
        self.query_one("#pair-lines", Static).update("\n".join(lines))
        asking = QUESTION if self._untold else WITHOUT_ROW
        self.query_one("#hint", Static).update(asking if self._left else HINT)
        self.query_one("#pairs", Past).scroll_to(y=self._row - 1, animate=False)

    def _say(self, sentence: str) -> None:
        """In place of the table."""
        heading = "" if self.tag_id is None else f"Tag {self.tag_id}"
        self.query_one("#heading", Static).update(heading)
        self.query_one(PictureView).draw(None)
        self.query_one("#hint", Static).update(HINT)
        self.query_one("#pair-lines", Static).update(sentence)


def _days(followed: FollowedPictures) -> tuple[int, int]:
    """Of which cluster, and how many."""
    return followed.rows.tag_id, len(followed.groups)
