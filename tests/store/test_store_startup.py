"""What a crash leaves behind is found at the next start, and nothing is thrown away."""

from __future__ import annotations

import gc
import os
import sqlite3
import stat
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from threading import Thread

import pytest
from stored_walks import FIRST_DAY, MadeWalk, SteppingClock, raw_pair, small_store

from fieldcam.errors import DatabaseTooNew, StorageDamaged, StorageError, StorageFull
from fieldcam.store.captures import load_raw
from fieldcam.store.connection import connect, connect_read_only, rows
from fieldcam.store.export import export_database
from fieldcam.store.folder import DataKind
from fieldcam.store.identity import identify
from fieldcam.store.migrations import migrate, steps, version_of
from fieldcam.store.queries.resuming import saved_capture, waiting_for_analysis
from fieldcam.store.recovery.integrity import FileFault, full_check, rehash
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.rows.judgements import Note
from fieldcam.store.space import Space
from fieldcam.store.store import open_store


def write_pair_only(path: Path, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `save` up to the moment before the transaction."""
    with small_store(path) as store, monkeypatch.context() as patch:
        patch.setattr(store, "append", lambda *entries: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            store.save(raw_pair(seed))


def test_a_sound_folder_has_nothing_to_say(tmp_path: Path) -> None:
    clock = SteppingClock()
    with small_store(tmp_path, clock) as store:
        walk = MadeWalk(store)
        walk.accept(walk.visit(), 11)
        report = startup_check(store, clock)
        assert report.sentences == ()
        assert not report.in_use
        full_check(store.database)
        assert rehash(store.database, store.objects) == ()


def test_a_pair_without_a_row_is_taken_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with small_store(tmp_path) as store:
        known = store.save(raw_pair(1))
    write_pair_only(tmp_path, 2, monkeypatch)
    with small_store(tmp_path) as store:
        report = startup_check(store)
        (adopted,) = report.taken_up.captures
        saved = saved_capture(store.database, adopted)
        assert saved is not None
        assert (load_raw(saved).left == raw_pair(2).left).all()
        assert load_raw(saved).pixel_format == load_raw(known).pixel_format
        assert report.sentences[0].startswith("Pictures taken up")
        assert [w.saved.key for w in waiting_for_analysis(store.database)] == [known.key, adopted]
        assert startup_check(store).taken_up.captures == ()


def test_a_pair_without_a_row_waits_where_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise StorageFull("No room is left.")

    with small_store(tmp_path) as store:
        store.save(raw_pair(1))
    write_pair_only(tmp_path, 2, monkeypatch)
    with small_store(tmp_path) as store:
        with monkeypatch.context() as patch:
            patch.setattr(store, "append", full)
            report = startup_check(store)
        assert report.taken_up.left == 2
        assert "The disk is full: 2 images" in report.sentences[0]
        assert len(startup_check(store).taken_up.captures) == 1


def test_files_that_make_no_pair_stay_as_they_are(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        single = store.objects.keep(b"P5\n1 1\n255\n0", ".pgm")
        report = startup_check(store)
        assert report.taken_up.loose == (single.name,)
        assert startup_check(store).taken_up.loose == ()
        assert single.exists()
        store.objects.keep(b"a calibration", ".yml")
        assert startup_check(store).taken_up.loose == ()
        assert startup_check(store).sentences == ()
        single.write_bytes(b"")
        assert startup_check(store).problems[0].fault is FileFault.CHANGED


def test_temporary_files_are_swept_unless_someone_writes(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        store.save(raw_pair())
        left_over = next((tmp_path / "objects").iterdir()) / ".x.pgm.123.part"
        left_over.write_bytes(b"half")
        with small_store(tmp_path):
            report = startup_check(store)
            assert report.in_use
            assert left_over.exists()
        assert startup_check(store).taken_up.swept == 1
        assert not left_over.exists()


def test_a_file_without_a_row_that_is_broken_is_left_alone(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        broken = store.objects.path("ab" + "0" * 62 + ".pgm")
        broken.parent.mkdir(parents=True)
        broken.write_bytes(b"x")
        report = startup_check(store)
        assert [problem.name for problem in report.taken_up.broken] == [broken.name]
        assert report.taken_up.loose == ()


def delete(path: Path) -> None:
    path.unlink()


def flip_a_byte(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("harm", "fault"),
    [(delete, FileFault.MISSING), (flip_a_byte, FileFault.CHANGED)],
)
def test_a_missing_or_changed_image_is_reported(
    tmp_path: Path, harm: Callable[[Path], None], fault: FileFault
) -> None:
    with small_store(tmp_path) as store:
        saved = store.save(raw_pair())
        harm(saved.left)
        (problem,) = startup_check(store).problems
        assert (problem.entry, problem.name, problem.fault) == (saved.key, saved.left.name, fault)
        assert rehash(store.database, store.objects) == (problem,)
        store.save(raw_pair(9))


@pytest.mark.parametrize(
    ("harm", "what"), [(delete, "missing"), (flip_a_byte, "not what was saved")]
)
def test_pictures_without_their_files_are_named_by_tag_and_day(
    tmp_path: Path, harm: Callable[[Path], None], what: str
) -> None:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        for tag_id in (11, 21):
            saved = made.take(made.visit(), tag_id)
            harm(saved.left)
            harm(saved.right)
        (sentence,) = startup_check(store).sentences
    day = f"{FIRST_DAY:%d %b %Y}"
    assert sentence.startswith(f"Image files that are {what}: 4, of tag 21 of {day}, tag 11 of")
    assert "Copy them back" in sentence and saved.left.name[:8] not in sentence


def test_only_the_first_of_many_hurt_files_are_named(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        for days_later in (0, 1):
            for tag_id in made.tags:
                made.take(made.visit(days_later), tag_id).left.unlink()
        store.objects.path(store.keep_calibration(b"a camera")).unlink()
        (sentence,) = startup_check(store).sentences
    assert "missing: 9, of a calibration, tag 22 of" in sentence and " and 4 more." in sentence


def test_a_damaged_page_is_one_sentence(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        for number in range(200):
            store.append(Note("x" * 500 + str(number)))
    path = tmp_path / "fieldcam.db"
    with path.open("r+b") as stream:
        stream.seek(path.stat().st_size - 3 * 4096)
        stream.write(b"\xff" * 4096)
    with small_store(tmp_path) as store, pytest.raises(StorageDamaged, match="is damaged"):
        startup_check(store)
    path.write_bytes(b"no database" * 1000)
    with pytest.raises(StorageDamaged, match="is damaged"):
        small_store(tmp_path)


def test_a_database_of_a_newer_version_is_refused(tmp_path: Path) -> None:
    small_store(tmp_path).close()
    with sqlite3.connect(tmp_path / "fieldcam.db") as connection:
        connection.execute(f"PRAGMA user_version={len(steps()) + 1}")
    connection.close()
    with pytest.raises(DatabaseTooNew, match="newer fieldcam"):
        small_store(tmp_path)


def test_a_database_of_another_program_is_refused(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "fieldcam.db") as connection:
        connection.execute("CREATE TABLE theirs (x)")
    connection.close()
    with pytest.raises(StorageError, match="not a database of fieldcam"):
        small_store(tmp_path)


def test_an_older_database_is_brought_up_to_date(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "fieldcam.db"
    database = connect(path)
    with monkeypatch.context() as patch:
        patch.setattr("fieldcam.store.migrations.steps", lambda: steps()[:1])
        assert migrate(database, path) == 1
    database.close()
    with small_store(tmp_path) as store:
        assert version_of(store.database) == len(steps())
        store.append(Note("written"))


def test_a_step_that_fails_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "fieldcam.db"
    database = connect(path)
    broken = ("CREATE TABLE first (x) STRICT;\nCREATE TABLE second (x INTEGER) STRICT;\n",)
    monkeypatch.setattr("fieldcam.store.migrations.steps", lambda: broken)
    with pytest.raises(sqlite3.OperationalError):
        migrate(database, path)
    assert version_of(database) == 0
    assert database.table_names() == []


def test_every_connection_is_durable(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        settings = {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1}
        for name, value in settings.items():
            assert rows(store.database, f"PRAGMA {name}") == [{name: value}]


def test_a_closed_store_keeps_no_file_open(tmp_path: Path) -> None:
    gc.disable()
    try:
        with small_store(tmp_path) as store:
            thread = Thread(target=lambda: store.append(Note("from another thread")))
            thread.start()
            thread.join()
        links = [link for link in Path("/proc/self/fd").iterdir() if link.is_symlink()]
        opened = [str(link.readlink()) for link in links]
        assert [name for name in opened if name.startswith(str(tmp_path))] == []
    finally:
        gc.enable()


def test_a_cloned_disk_gets_a_device_of_its_own(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        here = store.identity
        there = identify(store.database, "another machine")
        assert (here.copied, there.copied) == (False, True)
        assert here.device != there.device
        assert identify(store.database, "another machine") == there
        assert identify(store.database).device == here.device


def test_a_clock_set_back_is_said(tmp_path: Path) -> None:
    clock = SteppingClock()
    with small_store(tmp_path, clock) as store:
        store.append(Note("newest"))
        clock.wall -= timedelta(days=365)
        report = startup_check(store, clock)
        assert report.clock_behind is not None
        assert report.clock_behind > timedelta(days=364)
        assert any("clock" in sentence for sentence in report.sentences)


def test_the_gate_and_the_reserve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    space = Space(tmp_path, needed=1 << 62, reserve=1 << 16)
    with open_store(tmp_path, DataKind.FIELD, space=space) as store:
        with pytest.raises(StorageFull, match="free"):
            store.save(raw_pair())
        assert not (tmp_path / "objects").exists()
        report = startup_check(store)
        assert not report.reserve
        assert report.sentences[-1].endswith("Free some space before the next picture.")
    roomy = Space(tmp_path, needed=1, reserve=1 << 16)
    assert roomy.set_aside()
    with open_store(tmp_path, DataKind.FIELD, space=Space(tmp_path, needed=1 << 62)) as store:
        report = startup_check(store)
        assert report.reserve and report.sentences == (report.no_room,)
    assert (tmp_path / "reserve.bin").stat().st_blocks * 512 >= 1 << 16
    assert roomy.release()
    assert not roomy.release()


def test_an_exported_copy_is_one_whole_file(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        store.append(Note("in the copy"))
        target = tmp_path / "out" / "copy.db"
        export_database(store.database, target)
        assert [p.name for p in target.parent.iterdir()] == ["copy.db"]
        with pytest.raises(StorageError, match="already"):
            export_database(store.database, target)
    copy = connect_read_only(target)
    assert rows(copy, "SELECT text FROM note") == [{"text": "in the copy"}]
    copy.close()


def test_another_process_only_looks(tmp_path: Path) -> None:
    path = tmp_path / "fieldcam.db"
    with pytest.raises(StorageError, match="no database"):
        connect_read_only(path)
    with small_store(tmp_path) as store:
        follower = connect_read_only(path)
        store.append(Note("seen at once"))
        assert rows(follower, "SELECT text FROM note") == [{"text": "seen at once"}]
        with pytest.raises(StorageError, match="cannot be written"), follower.conn:
            rows(follower, "INSERT INTO here (device) VALUES ('x') RETURNING device")
        follower.close()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write to any folder")
def test_a_read_only_folder(tmp_path: Path) -> None:
    small_store(tmp_path).close()
    modes = {p: stat.S_IMODE(p.stat().st_mode) for p in (tmp_path, *tmp_path.iterdir())}
    try:
        for path, mode in modes.items():
            path.chmod(mode & ~0o222)
        with pytest.raises(StorageError) as found:
            small_store(tmp_path)
        assert found.value.hint
        reader = connect_read_only(tmp_path / "fieldcam.db")
        assert rows(reader, "SELECT count(*) AS n FROM device") == [{"n": 1}]
        reader.close()
    finally:
        for path, mode in modes.items():
            path.chmod(mode)
