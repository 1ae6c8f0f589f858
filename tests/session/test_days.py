"""A cluster and a block day by day, and every word about a cluster."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from stored_walks import FIRST_DAY, MadeWalk, raw_pair, small_store

from fieldcam.session.over_days.days import block_days, cluster_days
from fieldcam.store.captures import SavedCapture
from fieldcam.store.queries.history import capture_record
from fieldcam.store.queries.said import said
from fieldcam.store.queries.usage import bytes_per_capture, last_camera, newest_readings
from fieldcam.store.rows.judgements import (
    Action,
    Answer,
    Decision,
    FruitletMark,
    MarkKind,
    Note,
    Skip,
    TagCorrection,
    TargetCorrection,
)
from fieldcam.store.space import Space


@pytest.fixture
def walk(tmp_path: Path) -> MadeWalk:
    return MadeWalk(small_store(tmp_path))


def retake(walk: MadeWalk, visit: str, first: SavedCapture) -> str:
    """A picture of tag 11 in place of the first one, accepted with four fruitlets."""
    again = walk.store.save(raw_pair(9), visit=visit, tag_expected=11, retake_of=first.key).key
    walk.read(again, 11, 4)
    walk.store.append(Decision(again, Action.ACCEPT))
    return again


def test_the_sizes_of_a_day_are_those_of_the_accepted_pictures(walk: MadeWalk) -> None:
    visit, later = walk.visit(), walk.visit(2)
    walk.read(walk.take(visit, 11).key, 11, 7)
    few, many = walk.accept(visit, 11, 3), walk.accept(visit, 11, 5)
    walk.accept(visit, 12, 6)
    walk.take(later, 11)
    first, second = cluster_days(walk.store.database, walk.block, 11)
    assert (first.day, len(first.pictures), len(second.pictures)) == (FIRST_DAY, 3, 1)
    assert [picture.id for picture in first.counted] == [few, many]
    assert first.sizes_mm == (9.0, 10.0, 11.0, 12.0, 13.0)
    assert (second.counted, second.sizes_mm) == ((), ())


def test_of_equal_pictures_the_last_two_count(walk: MadeWalk) -> None:
    visit = walk.visit()
    walk.accept(visit, 11)
    last = [walk.accept(visit, 11) for _ in range(2)]
    (day,) = cluster_days(walk.store.database, walk.block, 11)
    assert [picture.id for picture in day.counted] == last


def test_what_is_struck_has_no_size_and_what_is_added_has_one(walk: MadeWalk) -> None:
    capture = walk.accept(walk.visit(), 11, 3)
    record = capture_record(walk.store.database, capture)
    assert record is not None and record.reading is not None
    reading = record.reading.id
    by_hand = MarkKind.ADDED_BY_HAND
    walk.store.append(
        FruitletMark.on_fruitlet(MarkKind.NOT_A_FRUITLET, reading, 0),
        FruitletMark(by_hand, reading=reading, diameter_mm=9.5),
        FruitletMark(by_hand, reading=reading, count=2),
    )
    (day,) = cluster_days(walk.store.database, walk.block, 11)
    assert day.sizes_mm == (9.5, 10.0, 11.0)
    (picture,) = day.counted
    assert picture.reading is not None
    assert picture.reading.by_hand_mm == (9.5, None, None)
    assert picture.reading.living == day.fruitlets == 5


def test_the_last_king_is_the_king_until_it_is_undone(walk: MadeWalk) -> None:
    capture = walk.accept(walk.visit(), 11, 3)
    record = capture_record(walk.store.database, capture)
    assert record is not None and record.reading is not None

    def kings() -> list[int]:
        now = capture_record(walk.store.database, capture)
        assert now is not None and now.reading is not None
        return [f.id for f in now.reading.fruitlets if MarkKind.KING in f.marks]

    marks = [FruitletMark.on_fruitlet(MarkKind.KING, record.reading.id, n) for n in (2, 1)]
    ids = [walk.store.append(mark)[0] for mark in marks]
    assert kings() == [1]
    walk.store.undo(ids[1])
    assert kings() == [2]


def test_a_block_is_counted_by_day(walk: MadeWalk) -> None:
    visit, later = walk.visit(), walk.visit(2)
    first = walk.take(visit, 11)
    walk.read(first.key, 11)
    walk.store.append(Decision(first.key, Action.RETAKE))
    retake(walk, visit, first)
    walk.accept(visit, 21, 2)
    walk.store.append(Skip(visit, 22))
    walk.take(visit, 12)
    walk.accept(later, 12, 1)
    walk.visit(3)
    replaced = walk.take(visit, 12).key
    walk.store.save(raw_pair(99), visit=visit, tag_expected=12, retake_of=replaced)
    day, second = block_days(walk.store.database, walk.block)
    assert (day.accepted, day.retaken, day.skipped, day.unread) == (2, 1, 1, 3)
    assert day.sizes_mm == (9.0, 9.0, 10.0, 10.0, 11.0, 12.0)
    assert (second.accepted, second.sizes_mm) == (1, (9.0,))
    assert day.times.duration_s is not None and day.times.duration_s > 0


def test_every_word_has_its_who_and_when(walk: MadeWalk) -> None:
    store, visit = walk.store, walk.visit()
    other = walk.accept(visit, 12)
    store.sign_in("Ann")
    capture = walk.take(visit, 11).key
    reading = walk.read(capture, 11)
    sayings = (
        Decision(capture, Action.ACCEPT, Answer.FALLEN),
        FruitletMark.on_cluster(MarkKind.FALLEN, visit, 11, 2),
        FruitletMark.on_fruitlet(MarkKind.KING, reading, 1),
        TagCorrection(capture, 11),
        TargetCorrection(reading, 1),
        Note("A leaf.", capture),
        Skip(visit, 11),
    )
    for saying in sayings:
        store.append(saying, why="so")
    store.append(Skip(visit, 22), Note("Elsewhere.", other))
    store.undo(store.append(Note("Not this.", capture))[0])
    words = said(store.database, walk.block, 11)
    assert tuple(word.saying for word in words) == sayings
    assert {(word.who, word.why) for word in words} == {("Ann", "so")}
    assert [word.capture for word in words] == [capture, None, *[capture] * 4, None]
    assert all(a.at < b.at for a, b in pairwise(words))
    offset = words[0].at.utcoffset()
    assert offset is not None and offset.total_seconds() == 7200


def test_a_picture_that_was_corrected_away_is_told_where_it_went(walk: MadeWalk) -> None:
    visit = walk.visit()
    capture = walk.accept(visit, 11)
    walk.store.append(TagCorrection(capture, 12))
    assert said(walk.store.database, walk.block, 11) == ()
    assert len(said(walk.store.database, walk.block, 12)) == 2


def test_what_pictures_cost_and_which_camera_took_them(walk: MadeWalk) -> None:
    database = walk.store.database
    assert bytes_per_capture(database) is None and last_camera(database) is None
    capture = walk.take(walk.visit(), 11).key
    row = capture_record(database, capture)
    assert row is not None
    before = bytes_per_capture(database)
    assert before is not None
    sizes = [
        walk.store.objects.path(name).stat().st_size for name in (row.left_file, row.right_file)
    ]
    assert before == sum(sizes)
    reading = walk.read(capture, 11)
    assert (bytes_per_capture(database) or 0) > before
    camera = last_camera(database)
    assert camera is not None
    assert (camera.left_serial, camera.right_serial) == ("L1", "R1")
    assert newest_readings(database, 3) == (reading,)


@pytest.mark.parametrize(("free", "left"), [(999, 0), (1000, 1), (1099, 1), (1100, 2)])
def test_room_is_counted_in_captures(
    free: int, left: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Space, "free_bytes", free)
    assert Space(tmp_path, needed=1000).captures_left(100.0) == left
