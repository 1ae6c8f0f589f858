"""Caliper sizes, names of fruit, and the operator's matches: rows, last words, old files."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_readings import TAG, disc_mask, encoded, made_fruitlet, made_reading
from stored_walks import FIRST_DAY, MadeWalk, facts_without_rows, small_store

from fieldcam.growth.places import MatchWord as Match
from fieldcam.growth.places import Place
from fieldcam.session.over_days.growing import block_rows, cluster_rows, followed_cluster, word_row
from fieldcam.store.clock import machine_id
from fieldcam.store.connection import connect, rows
from fieldcam.store.identity import identify
from fieldcam.store.journal import insert
from fieldcam.store.migrations import migrate, steps, version_of
from fieldcam.store.queries.calipers import (
    MeasuredTwice,
    caliper_sizes,
    measured_twice,
    named_fruitlets,
    names_in,
)
from fieldcam.store.queries.counted import association_words, counted_visits
from fieldcam.store.queries.said import said
from fieldcam.store.readings import reading_row
from fieldcam.store.rows.fruit import AssociationWord, CaliperIdentity, CaliperSize
from fieldcam.store.rows.judgements import (
    Action,
    Decision,
    FruitletMark,
    MarkKind,
    TargetCorrection,
)
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import Visit


@pytest.fixture
def walk(tmp_path: Path) -> Iterator[MadeWalk]:
    with small_store(tmp_path) as store:
        yield MadeWalk(store)


def reading_of(walk: MadeWalk, capture: EntryId) -> EntryId:
    sql = "SELECT reading FROM capture_now WHERE id = ?"
    reading: EntryId = rows(walk.store.database, sql, capture)[0]["reading"]
    return reading


def size(walk: MadeWalk, fruit: str, diameter_mm: float, tag_id: int = 11) -> CaliperSize:
    return CaliperSize(walk.block, tag_id, FIRST_DAY, fruit, diameter_mm)


def test_the_last_size_of_a_fruit_on_a_day_counts(walk: MadeWalk) -> None:
    store = walk.store
    later = CaliperSize(walk.block, 11, FIRST_DAY + timedelta(2), "fl1", 11.0, "sizes.csv")
    store.append(size(walk, "fl1", 9.0), size(walk, "fl2", 8.0), later)
    (again,) = store.append(size(walk, "fl1", 9.5))

    def found() -> list[tuple[str, float]]:
        return [
            (each.fruit, each.diameter_mm) for each in caliper_sizes(store.database, walk.block)
        ]

    assert found() == [("fl1", 9.5), ("fl2", 8.0), ("fl1", 11.0)]
    store.undo(again)
    assert found() == [("fl1", 9.0), ("fl2", 8.0), ("fl1", 11.0)]
    assert caliper_sizes(store.database, walk.block)[2].source == "sizes.csv"


@pytest.mark.parametrize(
    "row",
    [
        CaliperSize("", 11, FIRST_DAY, "fl1", 0.0),
        CaliperSize("", 11, FIRST_DAY, "", 9.0),
        CaliperIdentity("", 1, ""),
        AssociationWord("same", 1, "same", 2),
    ],
    ids=["no size", "no name", "no name of a fruitlet", "one picture"],
)
def test_rows_without_a_meaning_are_refused(
    walk: MadeWalk, row: CaliperSize | CaliperIdentity | AssociationWord
) -> None:
    with pytest.raises(sqlite3.IntegrityError, match="CHECK"):
        walk.store.append(row)


NAMES = st.lists(st.tuples(st.integers(0, 2), st.sampled_from("abc"), st.booleans()), max_size=8)


@settings(max_examples=25)
@given(said=NAMES)
def test_a_fruitlet_has_one_name_and_a_name_one_fruitlet(
    crowded: MadeWalk, said: list[tuple[int, str, bool]]
) -> None:
    """Against a plain table of the words that were not undone."""
    reading = reading_of(crowded, crowded.accept(crowded.visit(), 11))
    made = [(*each, crowded.store.append(CaliperIdentity(reading, *each[:2]))[0]) for each in said]
    standing: list[tuple[int, str]] = []
    for fruitlet, fruit, kept, entry in made:
        if not kept:
            crowded.store.undo(entry)
            continue
        standing.append((fruitlet, fruit))
    expected = {
        fruitlet: fruit
        for place, (fruitlet, fruit) in enumerate(standing)
        if not any(f == fruitlet or name == fruit for f, name in standing[place + 1 :])
    }
    assert names_in(crowded.store.database, reading) == expected


@pytest.fixture(scope="module")
def crowded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MadeWalk]:
    with small_store(tmp_path_factory.mktemp("data")) as store:
        yield MadeWalk(store)


def test_fruit_is_compared_by_name_and_day(walk: MadeWalk) -> None:
    store, visit = walk.store, walk.visit()
    first, second, bad, other = (walk.accept(visit, tag) for tag in (11, 11, 11, 12))
    store.append(Decision(bad, Action.RETAKE))
    a, b, c, d = (reading_of(walk, capture) for capture in (first, second, bad, other))
    # A made reading's fruitlet n measures 9 + n mm; those of the other cluster have no size.
    store.append(
        CaliperIdentity(a, 0, "fl1"),
        CaliperIdentity(b, 1, "fl1"),
        CaliperIdentity(c, 4, "fl1"),
        CaliperIdentity(a, 2, "fl2"),
        CaliperIdentity(a, 5, "fl3"),
        CaliperIdentity(a, 3, "struck"),
        FruitletMark.on_fruitlet(MarkKind.NOT_A_FRUITLET, a, 3),
        CaliperIdentity(d, 4, "fl1"),
        *(size(walk, fruit, 9.9) for fruit in ("fl1", "fl3", "fl4", "struck")),
        CaliperSize(walk.block, 12, FIRST_DAY, "fl1", 13.1),
    )
    named = named_fruitlets(store.database, walk.block)
    assert [(n.tag_id, n.fruit, n.fruitlet, n.diameter_mm) for n in named] == [
        (11, "fl1", 0, 9.0),
        (11, "fl2", 2, 11.0),
        (11, "fl3", 5, None),
        (11, "fl1", 1, 10.0),
        (12, "fl1", 4, 13.0),
    ]
    assert measured_twice(caliper_sizes(store.database, walk.block), named) == (
        MeasuredTwice(11, FIRST_DAY, "fl1", 9.9, 10.0),
        MeasuredTwice(12, FIRST_DAY, "fl1", 13.1, 13.0),
    )


A, B = "one", "other"
MATCHES = {
    "the last": ([(A, 0, B, 1), (A, 0, B, 2)], [(A, 0, B, 2)]),
    "of others": ([(A, 0, B, 1), (A, 1, B, 2)], [(A, 0, B, 1), (A, 1, B, 2)]),
    "one to one": ([(A, 0, B, 1), (A, 2, B, 1)], [(A, 2, B, 1)]),
    "from the other side": ([(A, 0, B, 1), (B, 1, A, 2)], [(B, 1, A, 2)]),
    "the same from the other side": ([(A, 0, B, 1), (B, 1, A, 0)], [(B, 1, A, 0)]),
    "not there": ([(A, 0, B, 1), (A, 0, B, None)], [(A, 0, B, None)]),
    "not there, from the other side": ([(A, 0, B, 1), (B, 1, A, None)], [(B, 1, A, None)]),
    "there again": ([(B, 1, A, None), (A, 0, B, 1)], [(A, 0, B, 1)]),
    "two not there": ([(A, 0, B, None), (A, 1, B, None)], [(A, 0, B, None), (A, 1, B, None)]),
}


@pytest.mark.parametrize("words, kept", MATCHES.values(), ids=MATCHES)
def test_matches_of_two_pictures_are_one_to_one(
    walk: MadeWalk,
    words: list[tuple[str, int, str, int | None]],
    kept: list[tuple[str, int, str, int | None]],
) -> None:
    ids = {
        A: reading_of(walk, walk.accept(walk.visit(), 11)),
        B: reading_of(walk, walk.accept(walk.visit(2), 11)),
    }

    def row(one: str, fruitlet: int, other: str, partner: int | None) -> AssociationWord:
        return AssociationWord(ids[one], fruitlet, ids[other], partner)

    entries = [walk.store.append(row(*word))[0] for word in words]
    found = association_words(walk.store.database, ids.values())
    assert found == tuple(row(*word) for word in kept)
    assert association_words(walk.store.database, [ids[A]]) == ()
    walk.store.undo(entries[-1])
    assert row(*words[0]) in association_words(walk.store.database, ids.values())


def test_of_two_devices_that_did_not_know_of_each_other_the_later_clock_counts(
    walk: MadeWalk,
) -> None:
    reading = reading_of(walk, walk.accept(walk.visit(), 11))
    database = walk.store.database
    (known,) = walk.store.append(CaliperIdentity(reading, 0, "known to both"))
    (entry,) = rows(database, "SELECT * FROM entry WHERE id = ?", known)
    other = identify(database, f"not {machine_id()}").device
    for device, hour, name in ((other, 12, "late"), (walk.store.identity.device, 10, "early")):
        new = {"id": name, "device": device, "seq": 1_000, "turn": entry["turn"] + 1}
        at = {"at_utc": f"2026-05-21T{hour}:00:00.000000+00:00"}
        insert(database, "entry", {**entry, **new, **at})
        row = {"id": name, "reading": reading, "fruitlet": 0, "fruit": name}
        insert(database, "caliper_identity", row)
    assert names_in(database, reading) == {0: "late"}


def test_what_counts_of_a_cluster_on_each_visit(walk: MadeWalk) -> None:
    store, first, second, third = walk.store, walk.visit(), walk.visit(2), walk.visit(4)
    fewest, early, late = (walk.accept(first, 11, n) for n in (3, 5, 4))
    discarded = walk.accept(first, 11, 6)
    store.append(Decision(discarded, Action.DISCARD))
    walk.take(first, 11)
    later = walk.accept(second, 11, 4)
    reading = reading_of(walk, later)
    store.append(
        TargetCorrection(reading_of(walk, late), 1),
        FruitletMark.on_fruitlet(MarkKind.NOT_A_FRUITLET, reading, 2),
        FruitletMark.on_fruitlet(MarkKind.FALLEN, reading, 3),
        FruitletMark.on_fruitlet(MarkKind.KING, reading, 0),
        FruitletMark(MarkKind.ADDED_BY_HAND, reading=reading, diameter_mm=9.0),
        FruitletMark.on_cluster(MarkKind.HIDDEN, second, 11, 2),
        FruitletMark.on_cluster(MarkKind.FALLEN, third, 11, 3),
    )
    walk.accept(first, 12)
    visits = counted_visits(store.database, walk.block, 11)
    assert counted_visits(store.database, walk.block)[:3] == visits
    assert [visit.tag_id for visit in counted_visits(store.database, walk.block)] == [
        11,
        11,
        11,
        12,
    ]
    # With cluster 1 as its target the late picture shows three fruitlets, as the first does.
    assert [[p.capture for p in visit.pictures] for visit in visits] == [[early, late], [later], []]
    assert fewest not in {p.capture for p in visits[0].pictures}
    assert [p.cluster for p in visits[0].pictures] == [None, 1]
    (shown,) = visits[1].pictures
    assert (sorted(shown.struck_out), sorted(shown.fallen)) == ([2], [3])
    assert [(visit.fallen, visit.hidden) for visit in visits] == [(0, 0), (0, 3), (3, 0)]


def test_of_a_robots_many_views_the_two_with_the_largest_target_area_count(
    walk: MadeWalk,
) -> None:
    visit = walk.visit()
    captures = [accept_discs(walk, visit, sides_px) for sides_px in ROBOT_VIEWS_PX]
    (counted,) = counted_visits(walk.store.database, walk.block, 11)
    assert [picture.capture for picture in counted.pictures] == [captures[1], captures[3]]


ROBOT_VIEWS_PX = ((18.0,) * 5, (30.0, 30.0), (12.0,) * 6, (24.0,) * 3, (25.0,))
"""Diameters of the target's masks; most fruitlets are not the largest area."""


def accept_discs(walk: MadeWalk, visit: EntryId, sides_px: tuple[float, ...]) -> EntryId:
    target = [
        replace(made_fruitlet(n, (100.0 + 40 * n, 100.0)), mask=disc_mask(100 + 40 * n, 100, side))
        for n, side in enumerate(sides_px)
    ]
    near = made_fruitlet(9, (400.0, 300.0), in_target=False, cluster=1)
    other = replace(near, mask=disc_mask(400, 300, 80))
    capture = walk.take(visit, 11).key
    reading = made_reading([*target, other], tag=replace(TAG, id=11))
    walk.store.append(
        reading_row(capture, encoded(reading), 400.0), Decision(capture, Action.ACCEPT)
    )
    return capture


def test_a_cluster_is_followed_with_its_words(walk: MadeWalk) -> None:
    captures = [walk.accept(walk.visit(day), 11, 4) for day in (0, 2)]
    walk.accept(walk.visit(), 12)
    a, b = (reading_of(walk, capture) for capture in captures)
    words = (Match(Place(a, 0), Place(b, 1)), Match(Place(b, 3), None, a))
    walk.store.append(*(word_row(word) for word in words))
    database = walk.store.database
    rows_11 = cluster_rows(database, walk.block, 11)
    followed = followed_cluster(database, rows_11)
    assert followed.words == words
    assert [[view.id for view in visit.views] for visit in followed.visits] == [[a], [b]]
    assert len(followed.visits[1].views[0].reading.target) == 4
    assert block_rows(database, walk.block) == (rows_11, cluster_rows(database, walk.block, 12))
    assert cluster_rows(database, walk.block, 22).visits == ()
    walk.read(captures[1], 11)
    again = cluster_rows(database, walk.block, 11)
    assert again != rows_11 and again.words == ()


def test_words_on_fruit_are_among_what_was_said(walk: MadeWalk) -> None:
    a, b = (walk.accept(walk.visit(day), 11) for day in (0, 2))
    one, other = reading_of(walk, a), reading_of(walk, b)
    sayings = (
        size(walk, "fl1", 9.0),
        CaliperIdentity(one, 0, "fl1"),
        AssociationWord(other, 2, one),
    )
    walk.store.append(size(walk, "fl1", 9.0, tag_id=12), *sayings)
    words = said(walk.store.database, walk.block, 11)[-3:]
    assert tuple(word.saying for word in words) == sayings
    assert [word.capture for word in words] == [None, a, b]


def test_a_file_of_the_form_before_is_brought_up_to_date(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it held is there still, and takes the new rows."""
    with monkeypatch.context() as patch:
        patch.setattr("fieldcam.store.migrations.steps", lambda: steps()[:3])
        old = small_store(tmp_path)
        walk = MadeWalk(old)
        # Its pictures had no facts beside them, and its visits no day said anew.
        patch.setattr("fieldcam.store.store.facts_of", facts_without_rows)
        (visit,) = old.append(Visit(walk.block, FIRST_DAY))
        capture = walk.take(visit, 11).key
        before = dump(old.database_path)
        assert version_of(old.database) == 3
        old.close()
    with small_store(tmp_path) as store:
        assert version_of(store.database) == len(steps())
        assert dump(store.database_path)[: len(before)] == before
        walk.store = store
        store.append(CaliperIdentity(walk.read(capture, 11), 0, "fl1"))
        assert [each.fruit for each in named_fruitlets(store.database, walk.block)] == ["fl1"]
        for action in ("DELETE FROM caliper_identity", "UPDATE caliper_identity SET fruit = 'x'"):
            with pytest.raises(sqlite3.IntegrityError, match="never changed"):
                store.database.execute(action)


def dump(path: Path) -> list[str]:
    """All rows that the file's entries name, in the order they were written."""
    database = connect(path)
    migrate(database, path)
    entries = rows(database, "SELECT * FROM entry ORDER BY turn")
    found = [
        json.dumps(
            [entry, rows(database, f"SELECT * FROM {entry['kind']} WHERE id = ?", entry["id"])]
        )
        for entry in entries
    ]
    database.close()
    return found
