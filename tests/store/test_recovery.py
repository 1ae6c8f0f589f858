"""After a lost, foreign or damaged database the pictures come back with all that was known."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from datetime import UTC
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from recorded_pairs import AtOnce, FakeAnalyst, write_pairs
from stored_walks import FIRST_DAY, MadeWalk, SteppingClock, raw_pair, small_store

from fieldcam.cli.main import main
from fieldcam.errors import ExitCode, RowsLost, StorageBusy, StorageDamaged, StorageError
from fieldcam.exchange.capture_folder import read_capture_folder
from fieldcam.session.catching_up import catch_up
from fieldcam.session.importing import import_pairs
from fieldcam.store.clock import Moment
from fieldcam.store.connection import rows
from fieldcam.store.facts import CaptureFacts, dump_facts, load_facts
from fieldcam.store.folder import MARKER_NAME, DataKind
from fieldcam.store.read_only import open_read_only
from fieldcam.store.recovery.integrity import full_check, rehash
from fieldcam.store.recovery.mending import recover
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.recovery.words import recovery_lines
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.orchard import Block
from fieldcam.store.rows.walk import Capture
from fieldcam.store.store import DATABASE_NAME, open_store

KNOWN = (
    "SELECT capture.id, capture.tag_expected, capture.view, capture.calibration, visit.day,"
    " block.name, tree.label, shutter.at_utc, capture.taken_at, capture.left_serial"
    " FROM capture JOIN visit ON visit.id = capture.visit JOIN block ON block.id = visit.block"
    " LEFT JOIN cluster_now AS cluster ON cluster.block = block.id"
    " AND cluster.tag_id = capture.tag_expected LEFT JOIN tree ON tree.id = cluster.tree"
    " LEFT JOIN event ON event.capture = capture.id AND event.event = 'shutter'"
    " LEFT JOIN entry AS shutter ON shutter.id = event.id ORDER BY capture.id"
)


def walk_of(folder: Path, pictures: int = 6) -> list[dict[str, Any]]:
    """Pictures of two visits with calibration and shutter times; what the rows say of them."""
    clock = SteppingClock()
    with small_store(folder, clock) as store:
        walk = MadeWalk(store)
        calibration = store.keep_calibration(b"a calibration")
        for n in range(pictures):
            store.save(
                raw_pair(n),
                visit=walk.visit(4 * (n % 2)),
                tag_expected=(11, 12, 21)[n % 3],
                view=1 + n // 3,
                shutter=clock(),
                calibration=calibration,
            )
        return rows(store.database, KNOWN)


def known(folder: Path) -> list[dict[str, Any]]:
    with small_store(folder) as store:
        full_check(store.database)
        assert rehash(store.database, store.objects) == ()
        return rows(store.database, KNOWN)


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@contextmanager
def crashed(folder: Path, card: Path) -> Iterator[Path]:
    """What a copy without the write-ahead log is, while the walk of a crash goes on."""
    with small_store(folder) as store:
        walk = MadeWalk(store)
        for _ in range(4):
            walk.accept(walk.visit(), 11)
        shutil.copytree(folder, card, ignore=shutil.ignore_patterns("*-wal", "*-shm"))
        yield card


def test_a_lost_database_is_made_again(tmp_path: Path) -> None:
    before = walk_of(tmp_path)
    (tmp_path / DATABASE_NAME).unlink()
    found = recover(tmp_path)
    assert (found.pictures, found.kept_as, found.mended) == (6, None, None)
    assert known(tmp_path) == before
    assert recover(tmp_path).pictures == 0


@pytest.mark.parametrize("opened", [lambda path: open_store(path, DataKind.FIELD), open_read_only])
def test_nothing_is_written_where_the_database_is_lost(
    tmp_path: Path, opened: Callable[[Path], object]
) -> None:
    walk_of(tmp_path)
    (tmp_path / DATABASE_NAME).unlink()
    before = contents(tmp_path)
    with pytest.raises(RowsLost, match="holds 6 pictures and no database"):
        opened(tmp_path)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("opened", [lambda path: open_store(path, DataKind.FIELD), open_read_only])
def test_a_copy_without_the_log_is_told_and_left_alone(
    tmp_path: Path, opened: Callable[[Path], object]
) -> None:
    with crashed(tmp_path / "data", tmp_path / "card") as card:
        before = contents(card)
        with pytest.raises(RowsLost, match="-wal beside it"):
            opened(card)
        assert contents(card) == before
        log = tmp_path / "data" / f"{DATABASE_NAME}-wal"
        shutil.copyfile(log, card / log.name)
        with closing(open_read_only(card)) as store:
            assert len(rows(store.database, "SELECT * FROM reading_now")) == 4


def test_a_copy_without_the_log_is_recovered_and_the_old_file_kept(tmp_path: Path) -> None:
    with crashed(tmp_path / "data", tmp_path / "card") as card:
        old = (card / DATABASE_NAME).read_bytes()
        found = recover(card)
        assert found.pictures == 4
        assert found.kept_as is not None
        assert (card / found.kept_as).read_bytes() == old
        days = {(row["day"], row["tag_expected"]) for row in known(card)}
        assert days == {(FIRST_DAY.isoformat(), 11)}


def test_the_last_rows_of_a_copy_are_missed_too(tmp_path: Path) -> None:
    walk_of(tmp_path / "data")
    with small_store(tmp_path / "data") as store:
        for n in range(3):
            store.save(raw_pair(100 + n))
        store.database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        for n in range(3):
            store.save(raw_pair(200 + n))
        left = shutil.ignore_patterns("*-wal", "*-shm")
        shutil.copytree(tmp_path / "data", tmp_path / "card", ignore=left)
    with pytest.raises(RowsLost, match="has no row for 3 of them"):
        open_store(tmp_path / "card", DataKind.FIELD)


def test_what_many_crashes_left_is_no_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Several programs that wrote were killed; the log that they left is there."""
    with small_store(tmp_path / "data") as store:
        MadeWalk(store)
        with monkeypatch.context() as patch:
            patch.setattr(store, "append", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
            for seed in range(4):
                with pytest.raises(KeyboardInterrupt):
                    store.save(raw_pair(seed))
        left = shutil.ignore_patterns("*-shm")
        shutil.copytree(tmp_path / "data", tmp_path / "left", ignore=left)
    with open_store(tmp_path / "left", DataKind.FIELD) as store:
        assert len(startup_check(store).taken_up.captures) == 4


def test_a_pair_that_a_crash_left_is_no_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with small_store(tmp_path) as store, monkeypatch.context() as patch:
        walk = MadeWalk(store)
        visit = walk.visit()
        patch.setattr(store, "append", lambda *entries: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            store.save(raw_pair(1), visit=visit, tag_expected=21)
    assert [(row["tag_expected"], row["label"]) for row in known(tmp_path)] == []
    recover(tmp_path)
    assert [(row["tag_expected"], row["label"]) for row in known(tmp_path)] == [(21, "tree 2")]


def spoil(file: Path, seed: int) -> None:
    """Zeros over a page in the middle, as a bad sector leaves."""
    content = bytearray(file.read_bytes())
    page = len(content) // 4096 * (3 + seed) // 8
    content[page * 4096 : (page + 1) * 4096] = bytes(4096)
    file.write_bytes(content)


@pytest.mark.parametrize("command", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_what_can_be_read_of_a_damaged_database_is_kept(
    tmp_path: Path, seed: int, command: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = walk_of(tmp_path, 12)
    with small_store(tmp_path) as store:
        walk = MadeWalk(store)
        for _ in range(10):
            walk.accept(walk.visit(8), 12)
    spoil(tmp_path / DATABASE_NAME, seed)
    if not command:
        monkeypatch.setattr(shutil, "which", lambda name: None)
    found = recover(tmp_path)
    assert found.mended is not None and found.mended.salvaged > 0
    assert found.kept_as == f"{DATABASE_NAME}.old-1"
    after = {row["id"]: row for row in known(tmp_path)}
    assert len(after) == 22
    assert [after[row["id"]]["day"] for row in before] == [row["day"] for row in before]
    with small_store(tmp_path) as store:
        assert len(rows(store.database, "SELECT * FROM decision_now")) >= 5


def test_the_header_may_be_gone(tmp_path: Path) -> None:
    before = walk_of(tmp_path)
    (tmp_path / DATABASE_NAME).write_bytes(b"x" * 5000)
    with pytest.raises(StorageDamaged, match="fieldcam recover"):
        open_store(tmp_path, DataKind.FIELD)
    assert recover(tmp_path).pictures == 6
    assert known(tmp_path) == before


def test_nobody_else_may_have_it_open(tmp_path: Path) -> None:
    with small_store(tmp_path), pytest.raises(StorageBusy):
        recover(tmp_path)


def test_there_must_be_something_to_recover(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="no data folder"):
        recover(tmp_path)


@pytest.mark.parametrize("rejected", [False, True])
def test_pictures_without_a_reading_are_read_and_not_decided_on(
    tmp_path: Path, rejected: bool
) -> None:
    season = write_pairs(tmp_path / "season", ("2026-05-21/17_1", "2026-05-25/17_1"))
    captures = read_capture_folder(season).captures
    data = tmp_path / "data"
    with small_store(data) as store:
        list(import_pairs(store, Block("North"), AtOnce(FakeAnalyst()), captures))
        if rejected:
            for row in rows(store.database, "SELECT id FROM capture"):
                store.append(Decision(row["id"], Action.DISCARD))
    (data / DATABASE_NAME).unlink()
    recover(data)
    analyst = FakeAnalyst()
    with small_store(data) as store:
        assert [each.problem for each in catch_up(store, AtOnce(analyst))] == ["", ""]
        assert [saved.calibration is not None for saved, _ in analyst.asked] == [True, True]
        assert rows(store.database, "SELECT * FROM decision") == []
        assert list(catch_up(store, AtOnce(analyst))) == []
        list(import_pairs(store, Block("North"), AtOnce(analyst), captures))
        decided = (
            "SELECT decision.action, operator.name FROM decision JOIN entry USING (id)"
            " JOIN operator ON operator.id = entry.who"
        )
        assert rows(store.database, decided) == [{"action": "accept", "name": "import"}] * 2


def test_a_database_of_which_nothing_can_be_read_is_told(tmp_path: Path) -> None:
    walk_of(tmp_path)
    (tmp_path / DATABASE_NAME).write_bytes(b"x" * 5000)
    lines = "\n".join(recovery_lines(recover(tmp_path)))
    assert "what was decided, noted, marked and typed in is gone" in lines
    assert "0 lost" not in lines


def test_the_command_says_what_it_did(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    walk_of(tmp_path)
    (tmp_path / DATABASE_NAME).unlink()
    with small_store(tmp_path / "other"):
        pass
    assert main(["--data", str(tmp_path), "growth"]) == ExitCode.STORAGE
    assert "`fieldcam recover` makes new rows" in capsys.readouterr().err
    assert main(["--data", str(tmp_path), "recover", "--json"]) == ExitCode.OK
    found = json.loads(capsys.readouterr().out)
    assert (found["pictures_rebuilt"], found["unread"], found["files"]) == (6, 6, [])
    assert main(["--data", str(tmp_path / "other"), "recover"]) == ExitCode.OK
    assert capsys.readouterr().out == "The database is whole.\n"


@pytest.mark.parametrize("kind", list(DataKind))
def test_a_folder_without_its_marker_is_told_and_mended(tmp_path: Path, kind: DataKind) -> None:
    with open_store(tmp_path, kind) as store:
        for n in range(6):
            store.save(replace(raw_pair(n), simulated=kind is DataKind.SIMULATED))
    marker = tmp_path / MARKER_NAME
    before = marker.read_bytes()
    marker.unlink()
    for opened in (lambda: open_store(tmp_path, kind), lambda: open_read_only(tmp_path)):
        with pytest.raises(
            StorageError, match=f"pictures and a database, but no {MARKER_NAME}"
        ) as told:
            opened()
        assert "`fieldcam recover`" in told.value.hint
    assert not marker.exists()
    recover(tmp_path)
    assert marker.read_bytes() == before


def test_a_folder_by_the_databases_name_is_told(tmp_path: Path) -> None:
    walk_of(tmp_path)
    file = tmp_path / DATABASE_NAME
    file.unlink()
    file.mkdir()
    ways = (
        lambda: recover(tmp_path),
        lambda: open_store(tmp_path, DataKind.FIELD),
        lambda: open_read_only(tmp_path),
    )
    for way in ways:
        with pytest.raises(StorageError, match="is a folder, and the database") as told:
            way()
        assert "Move this folder away" in told.value.hint
    file.rename(tmp_path / "elsewhere")
    assert recover(tmp_path).pictures == 6


def test_a_foreign_database_is_left_as_it_is(tmp_path: Path) -> None:
    small_store(tmp_path).close()
    file = tmp_path / DATABASE_NAME
    file.unlink()
    with closing(sqlite3.connect(file)) as other:
        other.execute("CREATE TABLE theirs (x)")
        other.commit()
    before = file.read_bytes()
    with pytest.raises(StorageError, match="not a database of fieldcam"):
        small_store(tmp_path)
    assert file.read_bytes() == before


MOMENTS = st.builds(
    Moment,
    st.datetimes().map(lambda at: at.replace(tzinfo=UTC)),
    st.integers(-900, 900),
    st.text(max_size=5),
    st.integers(0, 2**62),
)
"""Any moment that a row can hold."""


@given(st.text(max_size=20), st.one_of(st.none(), MOMENTS), st.one_of(st.none(), st.text()))
def test_facts_round_trip(name: str, shutter: Moment | None, tree: str | None) -> None:
    capture = Capture(
        "visit", 17, 2, None, "a.pgm", "b.pgm", 1, 2, "mono8", "2026-05-21T09:00:00+02:00",
        5, 7, name, "R", 3, False, None, "c.yml",
    )  # fmt: skip
    facts = CaptureFacts("id", capture, shutter, None, Block(name), tree)
    assert load_facts(dump_facts(facts)) == facts


@pytest.mark.parametrize("content", [b"", b"{}", b"[]", b'{"schema": 2}', b'{"schema": 1}'])
def test_what_are_no_facts_is_refused(content: bytes) -> None:
    with pytest.raises(ValueError, match=r"facts|Expecting"):
        load_facts(content)
