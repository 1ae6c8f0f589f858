"""What the screens read: the route, the next tag, the last count, where the walk stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
from made_readings import TAG, encoded, made_reading
from stored_walks import FIRST_DAY, MadeWalk, SteppingClock, raw_pair, small_store

from fieldcam.store.queries.blocks import blocks, settings, sprays, visits
from fieldcam.store.queries.durations import visit_times
from fieldcam.store.queries.history import capture_record, cluster_history, cluster_marks
from fieldcam.store.queries.resuming import last_undoable, resume, waiting_for_analysis
from fieldcam.store.queries.walks import ClusterState, Progress, expectation, walk_route
from fieldcam.store.readings import reading_row, stored_reading
from fieldcam.store.rows.judgements import (
    Action,
    Decision,
    FruitletMark,
    MarkKind,
    Note,
    Skip,
    TagCorrection,
    TargetCorrection,
)
from fieldcam.store.rows.orchard import BlockSetting, Cluster, Route, Setting, Spray
from fieldcam.store.rows.walk import AnalysisFailure, Event, EventKind
from fieldcam.values import Expectation, Status, Verdict


@pytest.fixture
def walk(tmp_path: Path) -> MadeWalk:
    return MadeWalk(small_store(tmp_path))


def taken(walk: MadeWalk, visit: str) -> None:
    walk.take(visit, 11)


def read(walk: MadeWalk, visit: str) -> None:
    walk.read(walk.take(visit, 11).key, 11)


def accepted(walk: MadeWalk, visit: str) -> None:
    walk.accept(visit, 11)


def to_retake(walk: MadeWalk, visit: str) -> None:
    walk.store.append(Decision(walk.take(visit, 11).key, Action.RETAKE))


def retaken(walk: MadeWalk, visit: str) -> None:
    to_retake(walk, visit)
    walk.accept(visit, 11)


def discarded(walk: MadeWalk, visit: str) -> None:
    walk.store.append(Decision(walk.take(visit, 11).key, Action.DISCARD))


def skipped(walk: MadeWalk, visit: str) -> None:
    walk.store.append(Skip(visit, 11))


def skipped_then_taken(walk: MadeWalk, visit: str) -> None:
    skipped(walk, visit)
    accepted(walk, visit)


def skip_undone(walk: MadeWalk, visit: str) -> None:
    walk.store.undo(walk.store.append(Skip(visit, 11))[0])


def accept_undone(walk: MadeWalk, visit: str) -> None:
    capture = walk.take(visit, 11).key
    walk.read(capture, 11)
    walk.store.undo(walk.store.append(Decision(capture, Action.ACCEPT))[0])


def wrong_tag_retaken(walk: MadeWalk, visit: str) -> None:
    """A neighbour's tag was read: the picture counts neither for it nor as done."""
    capture = walk.take(visit, 12).key
    walk.read(capture, 11)
    walk.store.append(Decision(capture, Action.RETAKE))


def tag_corrected(walk: MadeWalk, visit: str) -> None:
    capture = walk.accept(visit, 12)
    walk.store.append(TagCorrection(capture, 11))


@pytest.mark.parametrize(
    ("happened", "state", "next_tag"),
    [
        (taken, ClusterState.WAITING, 12),
        (read, ClusterState.UNDECIDED, 12),
        (accepted, ClusterState.ACCEPTED, 12),
        (to_retake, ClusterState.RETAKE, 11),
        (retaken, ClusterState.ACCEPTED, 12),
        (discarded, ClusterState.TODO, 11),
        (skipped, ClusterState.SKIPPED, 12),
        (skipped_then_taken, ClusterState.ACCEPTED, 12),
        (skip_undone, ClusterState.TODO, 11),
        (accept_undone, ClusterState.UNDECIDED, 12),
        (wrong_tag_retaken, ClusterState.TODO, 11),
        (tag_corrected, ClusterState.ACCEPTED, 12),
    ],
)
def test_the_state_of_a_cluster(
    walk: MadeWalk,
    happened: Callable[[MadeWalk, str], None],
    state: ClusterState,
    next_tag: int,
) -> None:
    visit = walk.visit()
    happened(walk, visit)
    route = walk_route(walk.store.database, visit)
    stop = route.stop(11)
    assert stop is not None
    assert stop.state is state
    assert route.next_tag() == next_tag


def test_an_accepted_picture_counts_for_the_tag_that_it_shows(walk: MadeWalk) -> None:
    visit = walk.visit()
    capture = walk.take(visit, 12).key
    walk.read(capture, 11)
    walk.store.append(Decision(capture, Action.ACCEPT))
    route = walk_route(walk.store.database, visit)
    assert {s.tag_id: s.state for s in route.stops if s.state is not ClusterState.TODO} == {
        11: ClusterState.ACCEPTED
    }


def test_a_picture_whose_verdict_is_retake_is_not_taken(walk: MadeWalk) -> None:
    visit = walk.visit()
    capture = walk.take(visit, 11).key
    blurred = made_reading(verdict=Verdict(Status.RETAKE), tag=replace(TAG, id=11))
    walk.store.append(reading_row(capture, encoded(blurred), 400.0))
    walk.take(visit, 12)
    walk.store.append(Skip(visit, 21))
    route = walk_route(walk.store.database, visit)
    assert (route.taken, route.skipped, route.next_tag(12)) == (1, 1, 22)
    walk.store.append(Skip(visit, 22))
    assert walk_route(walk.store.database, visit).next_tag(22) == 11
    walk.store.append(Decision(capture, Action.ACCEPT))
    assert walk_route(walk.store.database, visit).next_tag(22) is None


def test_the_route_is_the_planned_order_and_then_what_was_learned(walk: MadeWalk) -> None:
    visit = walk.visit()
    database = walk.store.database
    assert [s.tag_id for s in walk_route(database, visit).stops] == [11, 12, 21, 22]
    walk.store.append(Route(walk.block, (22, 21, 99)))
    walk.store.append(Cluster(walk.block, 31, walk.store.tree(walk.block, "tree 3")))
    route = walk_route(database, visit)
    assert [(s.tag_id, s.tree_label) for s in route.stops] == [
        (22, "tree 2"),
        (21, "tree 2"),
        (99, ""),
        (31, "tree 3"),
    ]
    assert route.progress(21) == Progress(tree=1, trees=3, cluster=2, clusters=2)
    assert route.progress(12) is None
    assert route.next_tag(after=31) == 22


def test_the_next_tag_goes_round_and_ends(walk: MadeWalk) -> None:
    visit = walk.visit()
    for tag_id in (12, 21, 22):
        walk.accept(visit, tag_id)
    assert walk_route(walk.store.database, visit).next_tag(after=22) == 11
    walk.accept(visit, 11)
    assert walk_route(walk.store.database, visit).next_tag(after=11) is None


MARKS: list[tuple[str, Callable[[str, str], FruitletMark | TargetCorrection], int]] = [
    ("struck out", lambda r, v: FruitletMark.on_fruitlet(MarkKind.NOT_A_FRUITLET, r, 0), 4),
    ("fallen", lambda r, v: FruitletMark.on_fruitlet(MarkKind.FALLEN, r, 1), 4),
    ("king", lambda r, v: FruitletMark.on_fruitlet(MarkKind.KING, r, 1), 5),
    ("not of the target", lambda r, v: FruitletMark.on_fruitlet(MarkKind.FALLEN, r, 6), 5),
    ("added", lambda r, v: FruitletMark(MarkKind.ADDED_BY_HAND, reading=r, x_px=1.0, y_px=1.0), 6),
    ("hidden behind a leaf", lambda r, v: FruitletMark.on_cluster(MarkKind.HIDDEN, v, 11, 2), 7),
    ("missing, so fallen", lambda r, v: FruitletMark.on_cluster(MarkKind.FALLEN, v, 11), 5),
    ("other cluster", lambda r, v: TargetCorrection(r, 1), 3),
]


@pytest.mark.parametrize(
    ("mark", "expected"), [case[1:] for case in MARKS], ids=[c[0] for c in MARKS]
)
def test_what_to_expect_of_a_cluster(
    walk: MadeWalk,
    mark: Callable[[str, str], FruitletMark | TargetCorrection],
    expected: int,
) -> None:
    first, second = walk.visit(), walk.visit(3)
    record = capture_record(walk.store.database, walk.accept(first, 11))
    assert record is not None
    assert record.reading is not None
    (entry,) = walk.store.append(mark(record.reading.id, first))
    assert expectation(walk.store.database, second, 11) == Expectation(11, expected)
    walk.store.undo(entry)
    assert expectation(walk.store.database, second, 11) == Expectation(11, 5)


def test_only_accepted_pictures_of_earlier_days_are_expected(walk: MadeWalk) -> None:
    first, second, third = (walk.visit(days) for days in (0, 3, 7))
    walk.accept(first, 11, fruitlets=6)
    walk.read(walk.take(second, 11).key, 11, fruitlets=2)
    assert expectation(walk.store.database, first, 11) == Expectation(11, None)
    assert expectation(walk.store.database, third, 11) == Expectation(11, 6)
    assert expectation(walk.store.database, third, 12) == Expectation(12, None)
    walk.accept(second, 11, fruitlets=4)
    walk.accept(second, 11, fruitlets=5)
    assert expectation(walk.store.database, third, 11) == Expectation(11, 5)


def test_a_clusters_history(walk: MadeWalk) -> None:
    first, second = walk.visit(), walk.visit(3)
    early = walk.accept(first, 11, fruitlets=5)
    late = walk.take(second, 11).key
    reading = walk.read(late, 11, fruitlets=4)
    walk.store.append(FruitletMark.on_fruitlet(MarkKind.KING, reading, 2), Note("leaf", late))
    walk.store.append(FruitletMark.on_cluster(MarkKind.FALLEN, second, 11))
    records = cluster_history(walk.store.database, walk.block, 11)
    assert [(r.id, r.action) for r in records] == [(early, Action.ACCEPT), (late, None)]
    assert records[0].day == FIRST_DAY
    assert records[1].notes == ("leaf",)
    summary = records[1].reading
    assert summary is not None
    assert summary.living == 4
    assert [f.marks for f in summary.fruitlets if f.marks] == [(MarkKind.KING,)]
    assert [f.diameter_mm for f in summary.fruitlets if f.in_target] == [9.0, 10.0, 11.0, 12.0]
    assert len(stored_reading(walk.store.database, summary.id).target) == 4
    marks = cluster_marks(walk.store.database, walk.block, 11)
    assert [(m.mark, m.count) for m in marks] == [(MarkKind.FALLEN, 1)]


def test_the_last_reading_of_a_picture_counts(walk: MadeWalk) -> None:
    visit = walk.visit()
    capture = walk.accept(visit, 11, fruitlets=5)
    again = walk.read(capture, 11, fruitlets=3)
    record = capture_record(walk.store.database, capture)
    assert record is not None
    assert record.reading is not None
    assert (record.reading.id, record.reading.living) == (again, 3)


def test_going_on_where_the_walk_stopped(walk: MadeWalk, tmp_path: Path) -> None:
    visit = walk.visit()
    walk.accept(visit, 11)
    pending = walk.take(visit, 12)
    walk.store.append(AnalysisFailure(pending.key, "crashed", "The analysis stopped."))
    walk.store.close()
    with small_store(tmp_path) as store:
        found = resume(store.database)
        assert found is not None
        assert (found.visit, found.tag_id, found.undecided) == (visit, 12, (pending.key,))
        (waiting,) = waiting_for_analysis(store.database)
        assert (waiting.saved, waiting.failures) == (pending, 1)
        (decision,) = store.append(Decision(pending.key, Action.ACCEPT))
        after = resume(store.database)
        assert after is not None
        assert after.tag_id == 21
        last = last_undoable(store.database, store.identity.device, visit)
        assert last is not None
        assert last.id == decision
        tree = store.tree(walk.block, "tree 3")
        store.append(Event(EventKind.WENT_TO, visit, tag_id=22, tree=tree))
        jumped = resume(store.database)
        assert jumped is not None
        assert jumped.tag_id == 22
        store.append(Event(EventKind.VISIT_ENDED, visit))
        assert resume(store.database) is None
        assert resume(store.database, visit) is not None


def test_seconds_per_cluster_survive_a_clock_set_back_a_year(tmp_path: Path) -> None:
    clock = SteppingClock()
    walk = MadeWalk(small_store(tmp_path, clock))
    visit = walk.visit()
    for number, tag_id in enumerate(walk.tags):
        if number == 2:
            clock.wall -= timedelta(days=365)
        shutter = clock()
        saved = walk.store.save(raw_pair(number), visit=visit, tag_expected=tag_id, shutter=shutter)
        walk.store.append(Decision(saved.key, Action.ACCEPT))
    times = visit_times(walk.store.database, visit)
    assert [(c.tag_id, c.at_cluster_s, c.since_last_s) for c in times.clusters] == [
        (11, 20.0, None),
        (12, 20.0, 30.0),
        (21, 20.0, 30.0),
        (22, 20.0, 30.0),
    ]
    assert times.median_s == 30.0


def test_pauses_are_no_work(tmp_path: Path) -> None:
    clock = SteppingClock()
    walk = MadeWalk(small_store(tmp_path, clock))
    visit = walk.visit()
    for tag_id in walk.tags:
        if tag_id == 21:
            clock.wall += timedelta(hours=1)
            clock.boot = "next"
        walk.accept(visit, tag_id)
    times = visit_times(walk.store.database, visit)
    assert [round(c.since_last_s or 0) > 3600 for c in times.clusters] == [
        False,
        False,
        True,
        False,
    ]
    assert times.median_s is not None and times.median_s < 60
    assert times.duration_s is not None and times.duration_s < 300


def test_blocks_settings_and_sprays(walk: MadeWalk) -> None:
    database, block = walk.store.database, walk.block
    visit = walk.visit()
    walk.accept(visit, 11)
    walk.take(visit, 12)
    (summary,) = blocks(database)
    assert (summary.trees, summary.clusters, summary.visits) == (2, 4, 1)
    assert summary.last_day == FIRST_DAY
    (seen,) = visits(database, block)
    assert (seen.captures, seen.accepted) == (2, 1)
    tree = walk.store.tree(block, "tree 1")
    walk.store.append(
        BlockSetting(block, Setting.TARGET_FRUIT_PER_TREE, 80.0),
        BlockSetting(block, Setting.BLOOM_CLUSTERS_PER_TREE, 120.0),
        BlockSetting(block, Setting.BLOOM_CLUSTERS_PER_TREE, 130.0, tree),
        BlockSetting(block, Setting.TARGET_FRUIT_PER_TREE, 90.0),
        Spray(block, FIRST_DAY, "6-BA", "2 l/ha"),
    )
    assert settings(database, block) == {
        Setting.TARGET_FRUIT_PER_TREE: 90.0,
        Setting.BLOOM_CLUSTERS_PER_TREE: 120.0,
    }
    assert settings(database, block, tree)[Setting.BLOOM_CLUSTERS_PER_TREE] == 130.0
    assert [s.product for s in sprays(database, block)] == ["6-BA"]
