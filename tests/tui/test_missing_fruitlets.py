"""CONFIRM is answered where both days can be seen: one answer for each missing fruitlet."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from made_tracks import tracked_by_id
from screens import LARGE, SMALL, Driven, drive
from stored_walks import MadeWalk, small_store

from fieldcam.growth.places import Place, Track
from fieldcam.session.commands import Accept, TellMissing, UndoLast
from fieldcam.session.events import Done, Refused, VerdictReady
from fieldcam.session.over_days.growing import FollowedCluster
from fieldcam.session.state import WalkState
from fieldcam.session.viewing import WalkView
from fieldcam.store.captures import SavedCapture
from fieldcam.store.rows.fruit import MissingWord
from fieldcam.store.rows.judgements import Answer, FruitletMark, MarkKind
from fieldcam.store.rows.row import EntryId
from fieldcam.tui.sound import Tune
from fieldcam.tui.text.news import news
from fieldcam.values import Status, Verdict

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])


@dataclass
class Asked:
    """Tag 11: five fruitlets on the first day, and a picture of three that is not decided."""

    made: MadeWalk
    visit: EntryId
    earlier: EntryId
    """Reading."""
    capture: EntryId

    def state(self) -> WalkState:
        view = WalkView(self.made.store, self.visit)
        return replace(view.state(), tag_id=11, shown=view.shown(11, view.route()))

    def place(self, fruitlet: int) -> Place:
        return Place(self.earlier, fruitlet)


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Asked]:
    monkeypatch.setattr("fieldcam.tui.screens.followed.tracks_of", tracked_by_id)
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        first, second = made.visit(), made.visit(2)
        before = made.take(first, 11).key
        earlier = made.read(before, 11)
        store.append(made.accepted(before))
        capture = made.take(second, 11).key
        made.read(capture, 11, 3)
        yield Asked(made, second, earlier, capture)


def chosen(driven: Driven) -> str:
    """The line of the table that the arrow points at."""
    return next(line for line in driven.text.splitlines() if line.startswith(" >"))


@SIZES
def test_two_days_opens_from_confirm_for_the_picture_that_is_not_decided(
    asked: Asked, size: tuple[int, int]
) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(asked.state())
        assert "2 fewer than last visit" in driven.text and "2 compares the days" in driven.text
        await driven.press("2")
        assert "not decided   2 missing to tell" in driven.text
        assert "D 12.00" in chosen(driven) and "its place looks empty" in chosen(driven)
        await driven.press("f", "down", "h")
        await driven.press("up", "up", "h")
        assert "3 is not missing" in driven.text
        await driven.press("escape")
        assert driven.text.startswith(" Walk")

    assert drive(size, script).walk.asked == [
        TellMissing(asked.capture, asked.place(3), Answer.FALLEN),
        TellMissing(asked.capture, asked.place(4), Answer.HIDDEN),
    ]


def test_one_that_has_no_row_is_told_too(asked: Asked, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where the earlier picture shows it without depth."""

    def without_e(cluster: FollowedCluster) -> tuple[Track, ...]:
        return tracked_by_id(cluster)[:3]

    monkeypatch.setattr("fieldcam.tui.screens.followed.tracks_of", without_e)

    async def script(driven: Driven) -> None:
        await driven.tell(asked.state())
        await driven.press("2")
        assert "has no row" in driven.text
        await driven.press("h")

    asked_for = drive(SMALL, script).walk.asked
    assert asked_for == [TellMissing(asked.capture, None, Answer.HIDDEN)]


def test_after_the_last_answer_the_walk_goes_on(asked: Asked) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(asked.state())
        await driven.press("2")
        await driven.tell(asked.state())
        assert driven.text.startswith(" Two days")
        await driven.tell(Done("Tag 11 accepted."), replace(asked.state(), tag_id=12, shown=None))
        assert driven.text.startswith(" Walk") and "Tag 11 accepted." in driven.text

    drive(SMALL, script)


def test_the_button_leads_there_too(asked: Asked) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(asked.state())
        await driven.pilot.click("#do-two_days")
        await driven.settle()
        assert driven.text.startswith(" Two days")

    drive(SMALL, script)


def test_what_was_told_is_shown_and_the_next_one_is_asked_for(asked: Asked) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(asked.state())
        await driven.press("2")
        asked.made.store.append(
            MissingWord(asked.visit, 11, asked.earlier, 3, Answer.FALLEN),
            FruitletMark.on_cluster(MarkKind.FALLEN, asked.visit, 11),
        )
        await driven.tell(asked.state())
        assert "not decided   1 missing to tell" in driven.text
        assert "fallen, told by hand" in driven.text
        assert "E 13.00" in chosen(driven) and "missing" in chosen(driven)
        await driven.press("u")
        await driven.tell(Refused("It cannot be."))
        assert "It cannot be." in driven.text

    assert drive(SMALL, script).walk.asked == [UndoLast()]


def test_what_has_no_depth_is_drawn_and_told(asked: Asked, monkeypatch: pytest.MonkeyPatch) -> None:
    """It may be one of those that seem to be missing, and has no place in space."""

    def without_c(cluster: FollowedCluster) -> tuple[Track, ...]:
        def there(track: Track) -> Track:
            kept = {
                day: replace(
                    visit,
                    places=tuple(
                        p for p in visit.places if p.fruitlet != 2 or p.reading == asked.earlier
                    ),
                )
                for day, visit in track.visits.items()
            }
            return replace(track, visits=kept)

        return tuple(map(there, tracked_by_id(cluster)))

    monkeypatch.setattr("fieldcam.tui.screens.followed.tracks_of", without_c)

    async def script(driven: Driven) -> None:
        await driven.tell(asked.state())
        await driven.press("2")
        assert "C on 23 May has no depth: it may be any of these" in driven.text
        assert "C?" in driven.text.split("mm a day")[0]

    drive(LARGE, script)


@pytest.mark.parametrize(("more", "said"), [(0, "ACCEPT"), (2, "CONFIRM")])
def test_the_news_ask_too(more: int, said: str) -> None:
    saved = SavedCapture("picture", Path("l"), Path("r"), Path("d"))
    told = news(VerdictReady(saved, 11, Verdict(Status.ACCEPT, ()), 400.0, more))
    assert told is not None and told.sentence == f"Tag 11: {said} (0.4 s)."
    assert told.tune is (Tune.BAD if more else Tune.GOOD)


def test_more_than_last_visit_is_a_question(asked: Asked) -> None:
    asked.made.read(asked.capture, 11, 7)

    async def script(driven: Driven) -> None:
        await driven.tell(asked.state())
        said = " ".join(driven.text.split())
        assert "2 more than last visit: hidden then, or not of this cluster?" in said
        assert "Enter keeps all" in said
        await driven.press("enter")

    assert drive(SMALL, script).walk.asked == [Accept()]
