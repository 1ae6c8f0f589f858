"""A disk that cannot keep SQLite's write-ahead log is told by name, at the first opening."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from fieldcam.cli import doctor
from fieldcam.cli.main import main
from fieldcam.errors import ExitCode, StorageError
from fieldcam.store.connection import check_disk, storage_errors
from fieldcam.store.folder import DataKind
from fieldcam.store.store import open_store


class CardConnection(sqlite3.Connection):
    """As on a card whose driver shares no memory: the log's index cannot be made."""

    def execute(self, sql: str, *parameters: object) -> sqlite3.Cursor:
        if "journal_mode=WAL" in sql:
            error = sqlite3.OperationalError("disk I/O error")
            error.sqlite_errorcode = sqlite3.SQLITE_IOERR_SHMMAP
            raise error
        return super().execute(sql, *parameters)  # type: ignore[arg-type]


@pytest.fixture
def card(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    connect = sqlite3.connect
    monkeypatch.setattr(
        "fieldcam.store.connection.sqlite3.connect",
        lambda *given, **named: connect(*given, **named, factory=CardConnection),
    )
    yield tmp_path


@pytest.mark.parametrize(
    "code",
    [
        sqlite3.SQLITE_IOERR_SHMOPEN,
        sqlite3.SQLITE_IOERR_SHMLOCK,
        sqlite3.SQLITE_IOERR_SHMMAP,
        sqlite3.SQLITE_PROTOCOL,
    ],
)
def test_the_cause_is_named(tmp_path: Path, code: int) -> None:
    error = sqlite3.OperationalError("disk I/O error")
    error.sqlite_errorcode = code
    with (
        pytest.raises(StorageError, match="cannot keep SQLite's write-ahead log"),
        storage_errors(tmp_path),
    ):
        raise error


def test_the_first_opening_says_so(card: Path) -> None:
    with pytest.raises(StorageError, match="cannot keep SQLite's write-ahead log"):
        open_store(card, DataKind.FIELD)
    with pytest.raises(StorageError, match="formatted for Linux"):
        check_disk(card)
    assert not list(card.glob(".probe-*"))


def test_the_doctor_says_so(
    card: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(doctor, "_checks", lambda data: iter([doctor._data_folder(data)]))
    assert main(["--data", str(card), "doctor", "--json"]) == ExitCode.OK
    (check,) = json.loads(capsys.readouterr().out)["checks"]
    assert check["health"] == "bad" and "write-ahead log" in check["text"]


def test_a_good_disk_is_left_as_it_was(tmp_path: Path) -> None:
    check_disk(tmp_path)
    assert list(tmp_path.iterdir()) == []
