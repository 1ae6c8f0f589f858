"""Naming fruitlets, measuring them by caliper and matching them, on a live walk."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest
from live_walks import Walked, read, walked
from stored_walks import FIRST_DAY

from fieldcam.growth.places import MatchWord, Place
from fieldcam.session.commands import MatchFruit, NameFruit, SecondView, UndoLast, Writing
from fieldcam.session.events import Done, Doubted, Refused, VerdictReady
from fieldcam.session.state import Shown
from fieldcam.store.queries.calipers import caliper_sizes, names_in
from fieldcam.store.queries.counted import association_words
from fieldcam.store.rows.row import EntryId


@pytest.fixture
def walk(tmp_path: Path) -> Iterator[Walked]:
    with walked(tmp_path) as found:
        found.start()
        yield found


def shoot(walk: Walked, tag_id: int = 11) -> tuple[Shown, EntryId]:
    """A picture of three fruitlets, with its reading."""
    shown = walk.shoot(read(tag_id, 3)).shown
    assert shown is not None and shown.record.reading is not None
    return shown, shown.record.reading.id


def second_view(walk: Walked) -> tuple[Shown, EntryId]:
    walk.analysis.outcomes.append(read(11, 3))
    shown = walk.after(SecondView(), VerdictReady)[1].shown
    assert shown is not None and shown.record.reading is not None
    return shown, shown.record.reading.id


def sizes(walk: Walked) -> list[tuple[int, str, float]]:
    found = caliper_sizes(walk.made.store.database, walk.made.block)
    assert all(size.day == FIRST_DAY for size in found)
    return [(size.tag_id, size.fruit, size.diameter_mm) for size in found]


def test_fruitlets_are_named_and_measured(walk: Walked) -> None:
    shown, reading = shoot(walk)
    name, said = partial(NameFruit, shown.id), []
    for fruitlet, fruit, size in ((0, " fl 3 ", 9.25), (1, "", 8.5), (2, "", None)):
        done, _ = walk.after(name(fruitlet, fruit, size), Done)
        said.append(done.sentence)
    assert said == [
        "Fruitlet A is called 3, 9.25 mm by caliper.",
        "Fruitlet B is called 1, 8.50 mm by caliper.",
        "Fruitlet C is called 2.",
    ]
    database = walk.made.store.database
    assert names_in(database, reading) == {0: "3", 1: "1", 2: "2"}
    assert sizes(walk) == [(11, "1", 8.5), (11, "3", 9.25)]
    undone, _ = walk.after(UndoLast(), Done)
    assert undone.sentence == "Undone: the fruit's name on tag 11."
    undone, _ = walk.after(UndoLast(), Done)
    assert undone.sentence == "Undone: the fruit's name and the caliper size on tag 11."
    assert names_in(database, reading) == {0: "3"}
    again, _ = walk.after(name(0, "", 9.5), Done)
    assert again.sentence == "Fruitlet A is called 3, 9.50 mm by caliper."
    assert sizes(walk) == [(11, "3", 9.5)]


def test_a_name_of_another_fruitlet_is_asked_about(walk: Walked) -> None:
    shown, reading = shoot(walk)
    name, database = partial(NameFruit, shown.id), walk.made.store.database
    walk.after(name(0, "fl3", 9.25), Done)
    doubt, _ = walk.after(name(1, " 3", 8.5), Doubted)
    assert doubt.sentence == "A is called 3 already. Is it B that is, and A not?"
    assert names_in(database, reading) == {0: "3"} and sizes(walk) == [(11, "3", 9.25)]
    walk.after(doubt.insist, Done)
    assert names_in(database, reading) == {1: "3"} and sizes(walk) == [(11, "3", 8.5)]
    # Another view of the day shows the same fruit again.
    other, again = second_view(walk)
    walk.after(NameFruit(other.id, 0, "fl3", None), Done)
    assert names_in(database, again) == {0: "3"}


def test_another_name_for_a_fruitlet_is_asked_about(walk: Walked) -> None:
    shown, reading = shoot(walk)
    name, database = partial(NameFruit, shown.id), walk.made.store.database
    walk.after(name(0, "fl3", 9.25), Done)
    walk.after(name(0, "3", 9.0), Done)
    doubt, _ = walk.after(name(0, "fl4", None), Doubted)
    assert doubt.sentence == "A is called 3 already. Is it called 4 from now on?"
    assert names_in(database, reading) == {0: "3"}
    walk.after(doubt.insist, Done)
    assert names_in(database, reading) == {0: "4"}


@pytest.mark.parametrize("off_mm, doubtful", [(2.9, False), (-2.9, False), (50.0, True)])
def test_a_size_far_from_the_cameras_is_asked_about_once(
    walk: Walked, off_mm: float, doubtful: bool
) -> None:
    shown, _ = shoot(walk)
    summary = shown.record.reading
    assert summary is not None
    camera_mm = summary.target[0].diameter_mm
    assert camera_mm is not None
    told_mm = camera_mm + off_mm
    command = NameFruit(shown.id, 0, "fl1", told_mm)
    if not doubtful:
        walk.after(command, Done)
        return
    doubt, _ = walk.after(command, Doubted)
    assert doubt.sentence == (
        f"The camera measured {camera_mm:.2f} mm on A. Is it {told_mm:.2f} mm by caliper?"
    )
    assert sizes(walk) == []
    walk.after(doubt.insist, Done)
    assert sizes(walk) == [(11, "1", told_mm)]


def test_what_makes_no_sense_is_refused(walk: Walked) -> None:
    shown, reading = shoot(walk)
    name = partial(NameFruit, shown.id)
    _, other = second_view(walk)
    here, gone = Place(reading, 0), Place(other, 9)
    commands: list[tuple[str, Writing]] = [
        ("measures between", name(0, "fl1", 0.0)),
        ("measures between", name(0, "fl1", 101.0)),
        ("measures between", name(0, "fl1", float("nan"))),
        ("Choose a fruitlet", name(9, "fl1", 9.0)),
        ("at most 20 letters", name(0, "x" * 21, 9.0)),
        ("at most 20 letters", name(0, "\x1b", 9.0)),
        ("no reading", NameFruit("no picture", 0, "fl1", 9.0)),
        ("look again", MatchFruit(MatchWord(here, gone))),
        ("look again", MatchFruit(MatchWord(gone, None, reading))),
        ("no reading", MatchFruit(MatchWord(here, None, "no reading"))),
        ("two pictures", MatchFruit(MatchWord(here, Place(reading, 1)))),
    ]
    for words, command in commands:
        refused, _ = walk.after(command, Refused)
        assert words in refused.sentence
    assert sizes(walk) == [] and names_in(walk.made.store.database, reading) == {}


def test_matches_are_kept_until_they_are_undone(walk: Walked) -> None:
    (_, one), (_, other) = shoot(walk), second_view(walk)
    words = MatchWord(Place(one, 0), Place(other, 2)), MatchWord(Place(other, 1), None, one)
    said = [walk.after(MatchFruit(word), Done)[0].sentence for word in words]
    assert said == ["Matched by hand.", "Unmatched by hand."]
    database = walk.made.store.database
    assert len(association_words(database, [one, other])) == 2
    undone, _ = walk.after(UndoLast(), Done)
    assert undone.sentence == "Undone: the match on tag 11."
    (kept,) = association_words(database, [one, other])
    assert (kept.one_reading, kept.one_fruitlet, kept.other_fruitlet) == (one, 0, 2)
