"""Rows are only added, numbered without a gap, and the last word that stands counts."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stored_walks import MadeWalk, SteppingClock, small_store

from fieldcam.store.connection import rows
from fieldcam.store.rows.judgements import Action, Decision, Note
from fieldcam.store.rows.orchard import Block
from fieldcam.store.store import Store

WRITER = """
import sys
from pathlib import Path
sys.path[:0] = {tests!r}
from stored_walks import small_store
from fieldcam.store.rows.judgements import Note
from fieldcam.store.rows.orchard import Block
with small_store(Path({folder!r})) as store:
    store.block(Block("shared"))
    for number in range(25):
        store.append(Note(str(number)), Note("second"))
"""


def numbers(store: Store) -> list[int]:
    return [row["seq"] for row in rows(store.database, "SELECT seq FROM entry ORDER BY seq")]


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MadeWalk]:
    with small_store(tmp_path_factory.mktemp("data")) as store:
        yield MadeWalk(store)


steps = st.lists(
    st.one_of(
        st.sampled_from(Action),
        st.tuples(st.booleans(), st.integers(0, 7)),
    ),
    max_size=8,
)


@settings(max_examples=25)
@given(steps)
def test_the_last_decision_that_was_not_undone_counts(
    walk: MadeWalk,
    steps: list[Action | tuple[bool, int]],
) -> None:
    """A step is a decision, or undoing (else redoing) an earlier one, in any order."""
    made: list[tuple[str, Action]] = []
    undone: set[str] = set()
    capture = walk.take(walk.visit(), 11).key
    for step in steps:
        if isinstance(step, Action):
            made.append((walk.store.append(Decision(capture, step))[0], step))
        elif made:
            back, which = step
            target = made[which % len(made)][0]
            (walk.store.undo if back else walk.store.redo)(target)
            (undone.add if back else undone.discard)(target)
    standing = [action for entry, action in made if entry not in undone]
    found = rows(walk.store.database, "SELECT action FROM capture_now WHERE id = ?", capture)
    assert found == [{"action": standing[-1] if standing else None}]
    assert numbers(walk.store) == list(range(1, len(numbers(walk.store)) + 1))


def test_two_writers_leave_no_gap(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        code = WRITER.format(tests=[str(Path(__file__).parents[1])], folder=str(tmp_path))
        writers = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(2)]
        assert [writer.wait(60) for writer in writers] == [0, 0]
        assert numbers(store) == list(range(1, 103))
        assert len(rows(store.database, "SELECT id FROM block")) == 1


def test_threads_share_a_store(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        before = len(numbers(store))
        with ThreadPoolExecutor(4) as threads:
            list(threads.map(lambda number: store.append(Note(str(number))), range(20)))
        assert numbers(store) == list(range(1, before + 21))


def test_rows_are_never_changed_or_deleted(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        store.append(Note("kept"))
        for table in store.database.table_names():
            for sql in (f"DELETE FROM {table}", f"UPDATE {table} SET rowid = rowid + 1"):
                if rows(store.database, f"SELECT 1 FROM {table} LIMIT 1"):
                    with pytest.raises(sqlite3.IntegrityError, match="never changed"):
                        store.database.execute(sql)


def test_who_when_and_why_go_with_each_row(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        (before,) = store.append(Note("unknown operator"))
        ann = store.sign_in("Ann")
        (after,) = store.append(Note("known"), why="asked")
        assert store.sign_in("Ann") == ann
        found = {row["id"]: row for row in rows(store.database, "SELECT * FROM entry")}
        assert (found[before]["who"], found[before]["why"]) == (None, None)
        assert (found[after]["who"], found[after]["why"]) == (ann, "asked")
        assert found[after]["at_utc"] == "2026-05-21T09:00:40.000000+00:00"
        assert (found[after]["utc_offset_min"], found[after]["boot"]) == (120, "boot")


def test_a_failed_append_leaves_nothing_and_no_gap(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        before = numbers(store)
        with pytest.raises(sqlite3.IntegrityError):
            store.append(Note("first"), Decision("no such capture", Action.ACCEPT))
        assert numbers(store) == before
        store.append(Note("next"))
        assert numbers(store) == [*before, len(before) + 1]


def test_the_last_word_does_not_depend_on_the_clock(tmp_path: Path) -> None:
    clock = SteppingClock()
    walk = MadeWalk(small_store(tmp_path, clock))
    capture = walk.take(walk.visit(), 11).key
    walk.store.append(Decision(capture, Action.RETAKE))
    clock.wall -= timedelta(days=365)
    walk.store.append(Decision(capture, Action.ACCEPT))
    found = rows(walk.store.database, "SELECT action FROM capture_now")
    assert found == [{"action": "accept"}]


def test_the_same_block_operator_and_visit_are_made_once(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        walk = MadeWalk(store)
        assert store.block(Block("North")) == walk.block
        assert walk.visit() == walk.visit()
        assert store.tree(walk.block, "tree 1") == store.tree(walk.block, "tree 1")
