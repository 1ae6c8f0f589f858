"""`fieldcam` alone, and the planned route: what they do before there is a screen."""

from __future__ import annotations

import asyncio
import os
import sqlite3
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace

import pytest
from stored_walks import FIRST_DAY, MadeWalk, raw_pair, small_store

from fieldcam.cli import app, console, main
from fieldcam.disk.durable import storage_error
from fieldcam.errors import ExitCode, RowsLost, StorageError, StorageFull
from fieldcam.store.folder import DataKind
from fieldcam.store.queries.blocks import block_named
from fieldcam.store.queries.walks import walk_route
from fieldcam.store.store import DATABASE_NAME, Store, open_store
from fieldcam.tui.questions.offer import Choice, Offer
from fieldcam.tui.questions.recover_offer import RecoverOffer

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """There is one, and no networks have to be hashed."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("FIELDCAM_DATA", raising=False)
    monkeypatch.setattr(app, "at_a_terminal", lambda: True)
    monkeypatch.setattr(app, "checked_models", lambda data: None)
    monkeypatch.setattr("fieldcam.app.beginning.may_recover", lambda trouble: False)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[Sequence[str]]:
    """What each app began with; it ended at once."""
    found: list[Sequence[str]] = []

    def run(start: object, lines: Sequence[str], **_: object) -> None:
        found.append(lines)

    monkeypatch.setattr("fieldcam.app.field.run", run)
    return found


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A data folder with one picture."""
    path = tmp_path / "data"
    with open_store(path, DataKind.FIELD) as store:
        store.save(raw_pair())
    return path


def choose(monkeypatch: pytest.MonkeyPatch, choice: Choice | None) -> list[str]:
    """What is chosen where the demo is offered; gives the sentences that were shown."""
    shown: list[str] = []

    def offered(no_camera: str) -> Choice | None:
        shown.append(no_camera)
        return choice

    monkeypatch.setattr("fieldcam.app.beginning.offered", offered)
    return shown


def test_without_a_terminal_it_is_wrong_usage_in_one_line(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(app, "at_a_terminal", lambda: False)
    assert main([]) == ExitCode.BAD_INPUT
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("fieldcam: The app needs a terminal")
    assert "fieldcam demo" in err and "fieldcam --help" in err and len(err.splitlines()) == 1


def test_without_a_terminal_nothing_is_drawn_in_its_place(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    followed: list[Path] = []
    monkeypatch.delenv("TEXTUAL_DRIVER", raising=False)
    monkeypatch.setattr("fieldcam.tui.follow_app.follow", followed.append)
    assert main(["follow"]) == ExitCode.BAD_INPUT
    out, err = capsys.readouterr()
    assert (out, followed) == ("", []) and "needs a terminal" in err
    monkeypatch.setenv("TEXTUAL_DRIVER", "textual.drivers.web_driver:WebDriver")
    assert main(["follow"]) == ExitCode.OK
    assert len(followed) == 1


@pytest.mark.parametrize(
    ("names", "sentence"),
    [(None, "There is no folder"), ([], "holds no captures"), (["1_left", "1_right"], "terminal")],
)
def test_a_replay_looks_at_its_folder_before_the_terminal(
    capsys: Capture, tmp_path: Path, names: list[str] | None, sentence: str
) -> None:
    folder = tmp_path / "season"
    if names is not None:
        (folder / "2026-05-21").mkdir(parents=True)
        for name in names:
            (folder / "2026-05-21" / f"17_{name}.png").write_bytes(b"x")
    assert main(["demo", "--replay", str(folder)]) == ExitCode.BAD_INPUT
    out, err = capsys.readouterr()
    assert out == "" and sentence in err and len(err.splitlines()) == 1


@pytest.mark.parametrize("term", ["dumb", "unknown", "", "xterm", "linux"])
def test_a_dumb_terminal_is_none(term: str, monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = SimpleNamespace(isatty=lambda: True)
    streams = SimpleNamespace(stdin=terminal, stdout=terminal, stderr=terminal)
    monkeypatch.setattr(console, "sys", streams)
    monkeypatch.setenv("TERM", term)
    assert console.at_a_terminal() == (term in ("xterm", "linux"))


@pytest.mark.parametrize("choice", [Choice.DEMO, Choice.SET_UP, None])
def test_without_camera_and_data_the_demo_is_offered(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    opened: list[Sequence[str]],
    choice: Choice | None,
) -> None:
    demos: list[Path | None] = []
    monkeypatch.setattr("fieldcam.cli.demo.at_a_terminal", lambda: True)
    monkeypatch.setattr("fieldcam.cli.demo.checked_models", lambda data: None)
    monkeypatch.setattr(
        "fieldcam.app.simulated.walk_simulated_row", lambda data, *rest: demos.append(data)
    )
    shown = choose(monkeypatch, choice)
    folder = tmp_path / "data"
    assert main(["--data", str(folder)]) == ExitCode.OK
    assert shown[0].startswith("No camera is plugged in.")
    assert demos == ([tmp_path / "data-demo"] if choice is Choice.DEMO else [])
    assert len(opened) == (choice is Choice.SET_UP)
    assert folder.exists() == (choice is Choice.SET_UP)


@pytest.mark.parametrize(
    ("key", "choice"),
    [
        ("enter", Choice.DEMO),
        ("d", Choice.DEMO),
        ("e", Choice.SET_UP),
        ("q", None),
        ("ctrl+c", None),
    ],
)
def test_the_offer_takes_one_key(key: str, choice: Choice | None) -> None:
    async def press() -> Choice | None:
        offer = Offer("No camera: none was found.")
        async with offer.run_test(size=(80, 24)) as pilot:
            await pilot.press(key)
        return offer.return_value

    assert asyncio.run(press()) is choice


def test_with_data_it_goes_on(data: Path, opened: list[Sequence[str]]) -> None:
    assert main(["--data", str(data)]) == ExitCode.OK
    assert list(opened[0]) == []


def damage(data: Path) -> None:
    (data / DATABASE_NAME).write_bytes(b"no database" * 1000)


def age(data: Path) -> None:
    with sqlite3.connect(data / DATABASE_NAME) as connection:
        connection.execute("PRAGMA user_version=999")
    connection.close()


def make_simulated(data: Path) -> None:
    (data / "fieldcam-data.json").write_text('{"kind": "simulated"}')


def hide_behind_a_file(data: Path) -> None:
    (data / "in-use.lock").unlink()
    (data / "in-use.lock").mkdir()


@pytest.mark.parametrize(
    ("harm", "sentence"),
    [
        (damage, "is damaged"),
        (age, "was written by a newer fieldcam"),
        (make_simulated, "holds simulated captures"),
        (hide_behind_a_file, "cannot be written"),
    ],
)
def test_a_folder_that_cannot_be_opened_is_one_sentence(
    capsys: Capture,
    data: Path,
    opened: list[Sequence[str]],
    harm: Callable[[Path], None],
    sentence: str,
) -> None:
    harm(data)
    assert main(["--data", str(data)]) == ExitCode.STORAGE
    out, err = capsys.readouterr()
    assert (out, opened) == ("", [])
    assert sentence in err and len(err.splitlines()) == 1


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (OSError(30, os.strerror(30)), "Read-only file system"),
        (OSError(28, os.strerror(28)), "No room is left"),
    ],
)
def test_a_disk_that_takes_nothing_is_one_sentence(
    capsys: Capture,
    data: Path,
    monkeypatch: pytest.MonkeyPatch,
    error: OSError,
    sentence: str,
) -> None:
    def fail(path: Path) -> None:
        raise storage_error(path, error)

    monkeypatch.setattr("fieldcam.store.store.FolderLock", fail)
    assert main(["--data", str(data)]) == ExitCode.STORAGE
    assert sentence in capsys.readouterr().err


def test_what_the_folder_lacks_is_said_and_the_app_opens(
    data: Path, opened: list[Sequence[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    next(data.glob("objects/*/*.pgm")).unlink()

    def wrong(data: Path) -> None:
        raise StorageFull("The networks are not whole.")

    monkeypatch.setattr(app, "checked_models", wrong)
    with open_store(data, DataKind.FIELD):
        assert main(["--data", str(data)]) == ExitCode.OK
    first, missing, in_use = opened[0]
    assert first == "The networks are not whole."
    assert missing.startswith("Image files that are missing: 1")
    assert in_use == "Another fieldcam has this data folder open."


def test_a_route_is_planned_from_a_table(capsys: Capture, tmp_path: Path) -> None:
    table = tmp_path / "route.csv"
    table.write_text("tree,tag\n1,5\n2,8\n")
    command = ["route", "import", str(table), "--block", "North", "--data", str(tmp_path / "d")]
    assert main(command) == ExitCode.OK
    assert capsys.readouterr().out == "Block North: The route has 2 tags in 2 trees.\n"
    with open_store(tmp_path / "d", DataKind.FIELD) as store:
        assert planned(store) == [5, 8]


def planned(store: Store) -> list[int]:
    block = block_named(store.database, "North")
    assert block is not None
    visit = store.visit(block.id, FIRST_DAY)
    return [stop.tag_id for stop in walk_route(store.database, visit).stops]


@pytest.mark.parametrize("rest", [["import"], ["import", "absent.csv", "--block", "North"], []])
def test_a_route_that_cannot_be_read_is_one_sentence(
    capsys: Capture, tmp_path: Path, rest: list[str]
) -> None:
    assert main(["--data", str(tmp_path / "d"), "route", *rest]) == ExitCode.BAD_INPUT
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not (tmp_path / "d").exists()


@pytest.mark.parametrize("inside", [".", "below"])
@pytest.mark.parametrize("command", [[], ["demo"], ["doctor"], ["models", "list"]])
def test_a_file_for_the_data_folder_is_refused_at_once(
    capsys: Capture,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    opened: list[Sequence[str]],
    command: list[str],
    inside: str,
) -> None:
    shown = choose(monkeypatch, Choice.SET_UP)
    file = tmp_path / "data"
    file.write_text("none of ours")
    assert main(["--data", str(file / inside), *command]) == ExitCode.STORAGE
    out, err = capsys.readouterr()
    assert out == "" and not shown and not opened
    assert err == f"fieldcam: {file} is a file, not a folder. Name a folder with --data.\n"


@pytest.mark.parametrize("yes", [True, False])
@pytest.mark.parametrize("trouble", ["lost", "damaged"])
def test_recovering_is_asked_for_before_anything_is_written(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    opened: list[Sequence[str]],
    capsys: Capture,
    trouble: str,
    yes: bool,
) -> None:
    data = tmp_path / "data"
    with small_store(data) as store:
        walk = MadeWalk(store)
        walk.take(walk.visit(), 11)
    file = data / DATABASE_NAME
    if trouble == "lost":
        file.unlink()
    else:
        damage(data)
    before = {path: path.read_bytes() for path in data.rglob("*") if path.is_file()}
    asked: list[str] = []

    def may_recover(error: StorageError) -> bool:
        asked.append(error.message)
        return yes

    monkeypatch.setattr("fieldcam.app.beginning.may_recover", may_recover)
    assert main(["--data", str(data)]) == (ExitCode.OK if yes else ExitCode.STORAGE)
    assert len(asked) == 1
    if yes:
        assert any("Rows made of the files" in line for line in opened[0])
    else:
        after = {path: path.read_bytes() for path in data.rglob("*") if path.is_file()}
        assert after == before
        assert asked[0] in capsys.readouterr().err


@pytest.mark.parametrize(("key", "wanted"), [("r", True), ("q", None), ("escape", None)])
def test_recovering_takes_its_own_key(key: str, wanted: bool | None) -> None:
    async def press() -> bool | None:
        offer = RecoverOffer(RowsLost("3 pictures and no database.", "Recover."))
        async with offer.run_test(size=(80, 24)) as pilot:
            await pilot.press("enter", "space")
            assert offer.return_value is None
            await pilot.press(key)
        return offer.return_value

    assert asyncio.run(press()) is wanted
