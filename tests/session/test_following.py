"""A follower sees what an app of another process writes, and says why when it sees nothing."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from queue import Queue

import numpy as np
import pytest
from made_cues import good_cue
from stored_walks import MadeWalk, small_store

from fieldcam.errors import StorageError
from fieldcam.session.aim.cue import Cue
from fieldcam.session.aim.preview_file import PreviewFile, preview_folder
from fieldcam.session.events import Previewed
from fieldcam.session.following import Follower, NotAiming, NothingToFollow, Sight
from fieldcam.session.state import WalkState
from fieldcam.store.connection import APPLICATION_ID
from fieldcam.store.read_only import open_read_only
from fieldcam.store.store import DATABASE_NAME

PATIENCE_S = 10.0


class Watched:
    """A follower that asks often, and what it told."""

    def __init__(self, folder: Path) -> None:
        self._told: Queue[Sight] = Queue()
        self.follower = Follower(folder, self._told.put, poll_s=0.005, retry_s=0.005)

    def until(self, right: Callable[[Sight], bool]) -> Sight:
        """The next sight that is right."""
        while not right(sight := self._told.get(timeout=PATIENCE_S)):
            pass
        return sight

    def walk(self, right: Callable[[WalkState], bool]) -> WalkState:
        found = self.until(lambda sight: isinstance(sight, WalkState) and right(sight))
        assert isinstance(found, WalkState)
        return found

    def preview(self) -> Previewed:
        found = self.until(lambda sight: isinstance(sight, Previewed))
        assert isinstance(found, Previewed)
        return found

    def unseen(self, part: str) -> None:
        self.until(lambda sight: isinstance(sight, NothingToFollow) and part in sight.sentence)


@contextmanager
def watched(folder: Path) -> Iterator[Watched]:
    found = Watched(folder)
    with closing(found.follower):
        yield found


def test_each_step_of_a_walk_is_seen(tmp_path: Path) -> None:
    with small_store(tmp_path) as store, watched(tmp_path) as seen:
        seen.unseen("No walk was begun yet.")
        made = MadeWalk(store)
        visit = made.visit()
        seen.walk(lambda state: state.tag_id == 11 and state.shown is None)
        capture = made.take(visit, 11).key
        state = seen.walk(lambda state: state.shown is not None)
        assert state.waiting == 1 and not state.simulated and state.block == "North"
        made.read(capture, 11)
        state = seen.walk(lambda state: state.shown is not None and state.shown.living == 5)
        assert state.shown is not None and state.shown.left.is_file() and state.waiting == 0
        made.accept(visit, 11, fruitlets=4)
        assert seen.walk(lambda state: state.tag_id == 12).next_tag == 21


def test_the_visit_that_is_walked_is_followed(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        made.accept(made.visit(), 11)
        with watched(tmp_path) as seen:
            first = seen.walk(lambda state: True).day
            made.take(made.visit(4), 12)
            later = seen.walk(lambda state: state.tag_id == 12 and state.shown is not None)
    assert (later.day - first).days == 4


def test_what_the_camera_sees_is_followed_until_it_is_old(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    file = PreviewFile(preview_folder(tmp_path))
    picture = np.arange(12, dtype=np.uint8).reshape(3, 4)
    with small_store(tmp_path) as store, watched(tmp_path) as seen:
        MadeWalk(store).visit()
        for cue in (good_cue(12), Cue(12, (12, 12)), Cue(12, problem="It is busy.")):
            file.keep_image(picture)
            file.keep_cue(cue)
            preview = seen.preview()
            np.testing.assert_array_equal(preview.picture, picture)
            assert preview.cue == cue
        file.remove()
        seen.until(lambda sight: isinstance(sight, NotAiming))
        file.keep_image(picture)
        seen_again = file.keep_cue(good_cue(12))
        assert seen.preview().cue.ready
        os.utime(seen_again, (1e9, 1e9))
        seen.until(lambda sight: isinstance(sight, NotAiming))


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b'{"place_mm": 3}'])
def test_a_preview_that_cannot_be_read_is_passed_over(content: bytes, tmp_path: Path) -> None:
    file = PreviewFile(tmp_path)
    file.keep_image(np.zeros((3, 4), np.uint8))
    file.keep_cue(good_cue(12)).write_bytes(content)
    assert file.load() is None and file.written_s() is not None


def test_a_folder_that_comes_later_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with watched(folder) as seen:
        seen.unseen(f"There is no data folder at {folder}.")
        with small_store(folder) as store:
            MadeWalk(store).visit()
            seen.walk(lambda state: True)


def test_a_database_that_is_taken_away_and_comes_back(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        made.take(made.visit(), 11)
    file = tmp_path / DATABASE_NAME
    copy = file.read_bytes()
    with watched(tmp_path) as seen:
        seen.walk(lambda state: True)
        file.unlink()
        seen.unseen("and no database")
        file.write_bytes(copy)
        seen.walk(lambda state: True)


def test_a_database_that_is_locked_is_waited_for(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        MadeWalk(store).visit()
    with closing(sqlite3.connect(tmp_path / DATABASE_NAME, isolation_level=None)) as other:
        other.execute("PRAGMA locking_mode=EXCLUSIVE")
        other.execute("BEGIN EXCLUSIVE")
        with watched(tmp_path) as seen:
            seen.unseen("locked")
            other.close()
            seen.walk(lambda state: True)


def test_a_writer_never_waits_for_a_follower(tmp_path: Path) -> None:
    with small_store(tmp_path) as store, watched(tmp_path) as seen:
        made = MadeWalk(store)
        visit = made.visit()
        store.database.execute("PRAGMA busy_timeout=0")
        for _ in range(20):
            made.accept(visit, 11)
        assert store.database.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()[0] == 0
        seen.walk(lambda state: state.tag_id == 12)


def user_version(version: int) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        with closing(sqlite3.connect(folder / DATABASE_NAME)) as database:
            database.execute(f"PRAGMA application_id={APPLICATION_ID}")
            database.execute(f"PRAGMA user_version={version}")

    return change


def older_views(folder: Path) -> None:
    with closing(sqlite3.connect(folder / DATABASE_NAME)) as database:
        database.execute("DROP VIEW note_now")


UNREADABLE: dict[str, tuple[Callable[[Path], object], str]] = {
    "newer": (user_version(99), "newer fieldcam"),
    "older": (user_version(1), "older fieldcam"),
    "older views": (older_views, "older fieldcam"),
    "damaged": (lambda folder: (folder / DATABASE_NAME).write_bytes(b"x" * 5000), "damaged"),
    "missing": (lambda folder: (folder / DATABASE_NAME).unlink(), "no database"),
}


@pytest.mark.parametrize(("spoil", "sentence"), UNREADABLE.values(), ids=UNREADABLE)
def test_what_cannot_be_read_is_said(
    spoil: Callable[[Path], object], sentence: str, tmp_path: Path
) -> None:
    small_store(tmp_path).close()
    spoil(tmp_path)
    with pytest.raises(StorageError, match=sentence):
        open_read_only(tmp_path)
    with watched(tmp_path) as seen:
        seen.unseen(sentence)


def test_looking_writes_nothing(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        made.take(made.visit(), 11)
    before = written(tmp_path)
    with watched(tmp_path) as seen:
        seen.walk(lambda state: state.shown is not None)
    assert written(tmp_path) == before
    assert not (tmp_path / f"{DATABASE_NAME}-wal").read_bytes()


def written(folder: Path) -> dict[Path, int]:
    """When each file was written last, SQLite's own index of readers apart."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {path: path.stat().st_mtime_ns for path in files if f"{DATABASE_NAME}-" not in path.name}


def test_the_end_is_said(tmp_path: Path) -> None:
    seen = Watched(tmp_path)
    seen.follower.close()
    seen.unseen("not followed any more")
