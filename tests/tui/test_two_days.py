"""Two days of a cluster side by side: which fruitlet is which, and saying it better."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import date, timedelta
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from live_walks import read
from made_states import shown_with
from made_tracks import tracked_by_id
from screens import LARGE, SMALL, Driven, check_golden, drive
from stored_walks import FIRST_DAY, MadeWalk, small_store

from fieldcam.growth.places import MatchWord, Place, Track, TrackedVisit
from fieldcam.growth.records import Presence, Sighting
from fieldcam.session.commands import MatchFruit, NameFruit, UndoMatch
from fieldcam.session.events import Done
from fieldcam.session.over_days.growing import FollowedCluster, word_row
from fieldcam.session.state import Shown, WalkState
from fieldcam.session.viewing import WalkView
from fieldcam.store.space import Space
from fieldcam.tui.looks import Look, PictureStyle
from fieldcam.tui.screens.pair_changes import told_changes
from fieldcam.tui.screens.pair_sketch import TwoStills
from fieldcam.tui.screens.pairs import PairRow, pair_lines, pairs_of, said_word
from fieldcam.tui.widgets.picture import draw_line
from fieldcam.tui.widgets.picture_view import PictureView
from fieldcam.tui.widgets.sketch import Label, Painted, stamped

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])
WORDS = Look(PictureStyle.NONE)


@dataclass
class Walked:
    """Tag 11 on two days: five fruitlets, then four."""

    made: MadeWalk
    state: WalkState
    one: str
    other: str
    """The readings of the two days."""


@pytest.fixture
def walked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Walked]:
    monkeypatch.setattr(Space, "free_bytes", 72_000_000_000)
    monkeypatch.setattr("fieldcam.tui.screens.followed.tracks_of", tracked_by_id)
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        first, second = made.visit(), made.visit(2)
        for visit, count in ((first, 5), (second, 4)):
            made.accept(visit, 11, count)
        made.accept(first, 12)
        view = WalkView(store, second)
        state = replace(view.state(), tag_id=11, shown=view.shown(11, view.route()))
        sql = "SELECT reading FROM capture_now WHERE tag_id = 11 ORDER BY turn"
        one, other = (row["reading"] for row in store.database.query(sql))
        yield Walked(made, state, one, other)


@SIZES
@pytest.mark.parametrize("look", [Look(), WORDS], ids=["blocks", "words"])
def test_two_days_side_by_side(walked: Walked, size: tuple[int, int], look: Look) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(walked.state)
        await driven.press("v", "t", "down")
        name = "two-days" if look.pictures is PictureStyle.BLOCKS else "two-days-words"
        check_golden(f"{name}-{size[0]}x{size[1]}", driven.text)
        await driven.press("t")
        assert driven.text.startswith(" Cluster")

    drive(size, script, look)


def test_one_key_says_who_a_fruitlet_is(walked: Walked) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(walked.state)
        await driven.press("v", "t", "2", "down", "0", "up", "up", "3", "5")
        assert "not one of each picture" in driven.text
        await driven.press("9")
        assert "There is no fruitlet 9 in these two pictures." in driven.text
        await driven.press("0", "u", "s")
        assert "There are no other pictures of these days." in driven.text
        await driven.press("left")
        assert "This cluster has no pictures of other days." in driven.text
        await driven.press("n", "p")
        assert "Tag 11" in driven.text and "of other days" not in driven.text

    one, other = walked.one, walked.other
    assert drive(SMALL, script).walk.asked == [
        MatchFruit(MatchWord(Place(one, 0), Place(other, 1))),
        MatchFruit(MatchWord(Place(one, 1), None, other)),
        # From the last row, whose fruitlet the later picture does not show.
        MatchFruit(MatchWord(Place(one, 4), Place(other, 2))),
        MatchFruit(MatchWord(Place(one, 4), None, other)),
        UndoMatch(11),
    ]


def test_what_was_said_is_shown_and_nothing_is_followed_twice(
    walked: Walked, monkeypatch: pytest.MonkeyPatch
) -> None:
    followed: list[int] = []

    def counting(cluster: FollowedCluster) -> tuple[Track, ...]:
        followed.append(len(cluster.words))
        return tracked_by_id(cluster)

    monkeypatch.setattr("fieldcam.tui.screens.followed.tracks_of", counting)
    word = MatchWord(Place(walked.one, 2), Place(walked.other, 2))

    async def script(driven: Driven) -> None:
        await driven.tell(walked.state)
        await driven.press("v", "t", "down", "down")
        assert ">  3    C 11.00    C 11.00   +0.00    ? 60% sure" in driven.text
        await driven.tell(walked.state)
        assert followed == [0]
        walked.made.store.append(word_row(word))
        await driven.tell(walked.state)
        assert ">  3    C 11.00    C 11.00   +0.00    by hand" in driven.text
        assert followed == [0, 1]
        walked.made.store.append(word_row(MatchWord(Place(walked.one, 4), None, walked.other)))
        await driven.tell(walked.state)
        await driven.press("down", "down")
        (line,) = (line for line in driven.text.splitlines() if ">  5 " in line)
        assert line.rstrip().endswith(", by hand")

    drive(SMALL, script)


def matched(cluster: FollowedCluster) -> tuple[Track, ...]:
    """Without words by id; a word of A's partner moves all others, and E is not seen any more."""
    if not cluster.words:
        return tracked_by_id(cluster)
    first, second = cluster.visits
    (one,), (other,) = first.views, second.views
    partners = ((0, 1), (1, 2), (2, None), (3, 3), (4, None), (None, 0))
    tracks = []
    for number, (left, right) in enumerate(partners, start=1):
        seen: dict[date, TrackedVisit] = {}
        if left is not None:
            place = Place(one.id, left)
            seen[first.day] = TrackedVisit(Sighting(Presence.SIZED, 9.0), (place,))
        if right is not None:
            place = Place(other.id, right)
            seen[second.day] = TrackedVisit(Sighting(Presence.SIZED, 9.0), (place,))
        else:
            seen[second.day] = TrackedVisit(Sighting(Presence.NOT_SEEN), ())
        tracks.append(Track(number, seen))
    return tuple(tracks)


def test_what_a_word_changes_for_others_is_told(
    walked: Walked, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fieldcam.tui.screens.followed.tracks_of", matched)
    word = MatchWord(Place(walked.one, 0), Place(walked.other, 1))

    async def script(driven: Driven) -> None:
        await driven.tell(walked.state)
        await driven.press("v", "t")
        walked.made.store.append(word_row(word))
        await driven.tell(Done("Matched by hand."), walked.state)
        assert (
            "Matched by hand. Also changed: 2 (B) is matched with C now; 3 (C) has no match any"
            " more; 5 (E) counts as not seen now; 6 (A) has no match any more."
        ) in " ".join(driven.text.split())
        assert "? Help" in driven.text.splitlines()[-1]

    drive(SMALL, script)


def test_what_changes_on_other_days_is_told_too(tmp_path: Path) -> None:
    def track(number: int, *places: Place) -> Track:
        sized = Sighting(Presence.SIZED, 9.0)
        days = (FIRST_DAY + timedelta(int(place.reading)) for place in places)
        return Track(
            number,
            {day: TrackedVisit(sized, (place,)) for day, place in zip(days, places, strict=True)},
        )

    shown = shown_with(tmp_path, read(5))
    summary = shown.record.reading
    assert summary is not None
    pair = tuple(
        replace(shown, record=replace(shown.record, reading=replace(summary, id=id)))
        for id in ("0", "1")
    )
    before = [track(1, Place("2", 0), Place("3", 0)), track(2, Place("2", 1), Place("3", 1))]
    after = [track(1, Place("2", 0), Place("3", 1)), track(2, Place("2", 1), Place("3", 0))]
    told = partial(told_changes, pair=(pair[0], pair[1]), said=frozenset())
    assert told(before, before) == ""
    assert told(before, after) == "Also changed: fruitlets of other days were matched anew."


def test_clicks_choose_on_the_left_and_match_on_the_right(walked: Walked) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(walked.state)
        await driven.press("v", "t")
        view = driven.app.screen.query_one(PictureView)
        sketch = view._sketch
        assert isinstance(sketch, TwoStills)
        size = view.size.width, view.size.height * 2
        labels = sketch.paint(size).labels
        left = next(label for label in labels if label.text == "D")
        right = [label for label in labels if label.text == "C"][1]
        assert left.x < size[0] / 2 < right.x
        for label in (left, right):
            offset = int(label.x), int(label.y / 2)
            await driven.pilot.click(PictureView, offset=offset)
            await driven.settle()
        assert ">  4" in driven.text

    word = MatchWord(Place(walked.one, 3), Place(walked.other, 2))
    assert drive(LARGE, script).walk.asked == [MatchFruit(word)]


def test_all_pictures_of_all_days_can_be_compared(walked: Walked) -> None:
    walked.made.accept(walked.made.visit(2), 11, 3)
    walked.made.accept(walked.made.visit(4), 11, 3)

    async def script(driven: Driven) -> None:
        await driven.tell(walked.state)
        await driven.press("v", "t")
        headings = []
        for key in ("s", "s", "s", "left", "left", "right"):
            headings.append(driven.text.splitlines()[1].strip())
            await driven.press(key)
        headings.append(driven.text.splitlines()[1].strip())
        assert headings == [
            "Tag 11   23 May and 25 May   pictures 1/3",
            "Tag 11   23 May and 25 May   pictures 2/3",
            "Tag 11   23 May and 23 May   pictures 3/3",
            "Tag 11   23 May and 25 May   pictures 1/3",
            "Tag 11   21 May and 23 May   pictures 1/3",
            "Tag 11   23 May and 25 May   pictures 1/3",
            "Tag 11   21 May and 23 May   pictures 1/3",
        ]

    drive(SMALL, script)


@pytest.mark.parametrize("tag_id", [12, 21])
def test_with_less_than_two_pictures_it_is_said(walked: Walked, tag_id: int) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(replace(walked.state, tag_id=tag_id))
        await driven.press("v", "t", "left", "s", "down", "1", "0")
        assert f"Tag {tag_id}" in driven.text
        assert "There are no two accepted pictures of this cluster" in driven.text
        route = replace(walked.state.route, block="another", stops=())
        await driven.tell(replace(walked.state, tag_id=None, route=route))
        assert "This block has no clusters yet." in driven.text

    assert drive(SMALL, script).walk.asked == []


def test_pairs_of_days_and_views(tmp_path: Path) -> None:
    a, b, c, d = (shown_with(tmp_path) for _ in range(4))
    pairs: dict[tuple[tuple[Shown, ...], ...], tuple[tuple[tuple[Shown, Shown], ...], ...]] = {
        (): (),
        ((a,),): (),
        ((a, b),): (((a, b),),),
        ((a,), (b,)): (((a, b),),),
        ((a, b), (c,), (d,)): (((a, c), (b, c), (a, b)), ((c, d),)),
    }
    for days, expected in pairs.items():
        assert pairs_of(days) == expected


@pytest.mark.parametrize(
    ("grown_mm", "sds_mm", "ends"),
    [
        (4.9, (None, None), "8.80      13.70   +2.45"),
        (8.0, (None, None), "8.80      16.80   +4.00    ? no fruit grows so"),
        (-0.6, (None, None), "8.80       8.20   -0.30"),
        (-0.6, (0.1, None), "8.80 ±0.10          8.20   -0.30"),
        (-0.6, (0.1, 0.2), "8.80 ±0.10    8.20 ±0.20   -0.30"),
        (-0.6, (0.1, 0.1), "8.80 ±0.10    8.20 ±0.10   -0.30    ? no fruit shrinks so"),
        (-1.6, (None, None), "8.80       7.20   -0.80    ? no fruit shrinks so"),
    ],
)
def test_growth_that_no_fruitlet_has_is_marked(
    tmp_path: Path, grown_mm: float, sds_mm: tuple[float | None, float | None], ends: str
) -> None:
    later = shown_with(tmp_path)
    day = later.record.day
    assert day is not None
    earlier = replace(later, record=replace(later.record, day=day - timedelta(days=2)))
    sizes_mm = 8.8, 8.8 + grown_mm
    row = PairRow(
        1, Place("one", 0), Place("other", 0), sizes_mm, (None, None), 1.0, False, sds_mm=sds_mm
    )
    heading, line = pair_lines([row], (earlier, later), 1)
    assert line.endswith(ends)
    assert heading.index("mm a day") == line.index(f"{grown_mm / 2:+.2f}")


def test_what_a_key_says(tmp_path: Path, walked: Walked) -> None:
    shown = walked.state.shown
    assert shown is not None and shown.record.reading is not None
    summary = shown.record.reading
    one, other = (
        replace(shown, record=replace(shown.record, reading=replace(summary, id=reading)))
        for reading in ("one", "other")
    )

    def row(number: int, left: int | None, right: int | None) -> PairRow:
        places = (None if n is None else Place(r, n) for r, n in (("one", left), ("other", right)))
        first, second = places
        return PairRow(number, first, second, (None, None), (None, None), 1.0, False)

    rows = (row(1, 0, 5), row(2, 1, None), row(3, None, 6))
    expected = {
        (1, 1): MatchWord(Place("one", 0), Place("other", 5)),
        (1, 3): MatchWord(Place("one", 0), Place("other", 6)),
        (1, 2): None,
        (1, 0): MatchWord(Place("one", 0), None, "other"),
        (2, 3): MatchWord(Place("one", 1), Place("other", 6)),
        (2, 2): None,
        (2, 0): MatchWord(Place("one", 1), None, "other"),
        (3, 1): MatchWord(Place("one", 0), Place("other", 6)),
        (3, 2): MatchWord(Place("one", 1), Place("other", 6)),
        (3, 0): MatchWord(Place("other", 6), None, "one"),
        (4, 1): None,
        (1, 9): None,
    }
    for (chosen, number), word in expected.items():
        assert said_word(rows, chosen, number, (one, other)) == word, (chosen, number)


def test_lines_are_whole_or_dashed() -> None:
    image = np.zeros((9, 40, 3), np.uint8)
    draw_line(image, (0, 4), (39, 4), (9, 9, 9))
    assert (image[4, :, 0] == 9).all() and not image[[3, 5]].any()
    dashed = np.zeros_like(image)
    draw_line(dashed, (0, 4), (39, 4), (9, 9, 9), dash=4)
    assert 15 <= (dashed[4, :, 0] == 9).sum() <= 25
    draw_line(dashed, (-5, -5), (60, 60), (9, 9, 9))


def test_numbers_are_stamped_inside_the_picture() -> None:
    image = np.full((40, 60, 3), 7, np.uint8)
    for x, y in ((30.0, 20.0), (-5.0, -5.0), (90.0, 90.0)):
        found = stamped(Painted(image, (Label(x, y, "12", (200, 0, 0)),)), 2)
        assert found.shape == image.shape and (image == 7).all()
        written = (found == (200, 0, 0)).all(axis=2) | (found == 0).all(axis=2)
        # Two digits of 4 x 5 dots with one between them and one around: 2 pixels each.
        assert written.sum() == (4 + 1 + 3 + 2) * 7 * 4


def test_every_cluster_with_pictures_is_reached_without_a_route(walked: Walked) -> None:
    """As in a block that was walked without a screen: nobody stands anywhere."""
    state = replace(
        walked.state, tag_id=None, shown=None, route=replace(walked.state.route, stops=())
    )
    one, other = walked.one, walked.other

    async def script(driven: Driven) -> None:
        await driven.tell(state)
        await driven.press("v")
        assert "Tag 11   2 days, 2 pictures" in driven.text
        await driven.press("n")
        assert "Tag 12   1 day, 1 picture" in driven.text
        await driven.press("p", "c")
        await driven.type("9.5")
        await driven.type("fl3")
        await driven.press("t", "2")
        assert "Tag 11   21 May and 23 May" in driven.text
        await driven.press("n")
        assert "Tag 12" in driven.text and "no two accepted pictures" in driven.text
        await driven.press("escape")
        assert "Tag 12   1 day, 1 picture" in driven.text
        await driven.press("escape", "v")
        assert "Tag 11" in driven.text

    (measured, matched) = drive(SMALL, script).walk.asked
    assert isinstance(measured, NameFruit)
    assert measured == NameFruit(measured.capture, 0, "fl3", 9.5)
    assert matched == MatchFruit(MatchWord(Place(one, 0), Place(other, 1)))
