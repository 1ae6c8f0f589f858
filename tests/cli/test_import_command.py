"""`fieldcam import` counts what it did, lists what it could not do, and can be run again."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NoReturn

import pytest
from recorded_pairs import QUESTION, AtOnce, FakeAnalyst, write_image, write_pairs

from fieldcam.analysis.messages import Setup
from fieldcam.cli import main, self_test
from fieldcam.cli.progress import progress
from fieldcam.errors import ExitCode, StorageFull
from fieldcam.exchange.images import write_png
from fieldcam.store.connection import connect_read_only, rows
from fieldcam.store.space import Space
from fieldcam.values import Status

Capture = pytest.CaptureFixture[str]
THREE = ("2026-05-21/17_1", "2026-05-21/18_1", "2026-05-25/17_1")
PUT_IT = ": put calibration.yml into the folder that is imported."


@pytest.fixture(autouse=True)
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is read from or written to the user's own folders."""
    monkeypatch.setenv("FIELDCAM_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def analyst(monkeypatch: pytest.MonkeyPatch) -> FakeAnalyst:
    fake = FakeAnalyst()

    @contextmanager
    def start_fake(setup: Setup, data: Path) -> Iterator[AtOnce]:
        assert setup == Setup(None, data=data)
        yield AtOnce(fake)

    monkeypatch.setattr("fieldcam.app.analysis.start_analysis", start_fake)
    return fake


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_pairs(tmp_path / "season", THREE)


def run(capsys: Capture, *argv: object) -> tuple[int, str, str]:
    code = main(["import", *map(str, argv)])
    out, err = capsys.readouterr()
    return code, out, err


def document(capsys: Capture, folder: Path) -> dict[str, Any]:
    code, out, _ = run(capsys, folder, "--block", "North", "--json")
    assert code == ExitCode.OK
    found: dict[str, Any] = json.loads(out)
    return found


def test_the_document_counts_and_a_second_run_adds_nothing(
    capsys: Capture, folder: Path, analyst: FakeAnalyst
) -> None:
    assert document(capsys, folder) == {
        "block": "North",
        "pairs": 3,
        "added": 3,
        "known": 0,
        "skipped": 0,
        "unpaired": 0,
        "analysed": 3,
        "accepted": 3,
        "retakes": 0,
        "to_confirm": [],
        "to_retake": [],
        "problems": [],
        "unread": 0,
        "mended": 0,
    }
    again = document(capsys, folder)
    assert (again["added"], again["known"], again["analysed"]) == (0, 3, 0)


def test_days_that_no_season_has_are_asked_about(
    capsys: Capture, tmp_path: Path, analyst: FakeAnalyst
) -> None:
    """A folder by itself, and together with what the block has."""
    first = write_pairs(tmp_path / "first", ("2025-05-21/17_1",))
    later = write_pairs(tmp_path / "later", ("2026-05-21/17_1", "2162-05-21/17_1"))
    assert "Is " not in run(capsys, first, "--block", "North")[2]
    _, _, err = run(capsys, later, "--block", "North")
    assert "2162-05-21 lies after today" in err
    assert "From the visit of 2025-05-21 to that of 2026-05-21 there are 365 days" in err


def test_bad_pairs_are_listed_at_the_end_with_one_sentence_each(
    capsys: Capture, folder: Path, analyst: FakeAnalyst
) -> None:
    (folder / "2026-05-21" / "17_1_left.png").write_bytes(b"")
    (folder / "2026-05-25" / "9_1_left.png").write_bytes(b"x")
    (folder / "2026-05-25" / "9_0_left.png").write_bytes(b"x")
    code, out, err = run(capsys, folder, "--block", "North")
    assert code == ExitCode.OK
    assert "Block North: 3 pairs; 2 added, 0 there before, 1 skipped." in out
    assert "Left out: 1 image without the other eye's." in out
    listed = [line.strip() for line in out.partition("Problems:\n")[2].splitlines()][:3]
    assert listed == [
        "2026-05-21/17_1_left.png is empty.",
        "2026-05-25/9_0_left.png: 9_0_left.png is no <tag>_<n>_left or _right image.",
        "2026-05-25/9_1_left.png: 9_1_left.png has no partner from the other eye.",
    ]
    assert err.splitlines() == [f"{n} of 3 captures" for n in (1, 2, 3)]
    again = document(capsys, folder)
    assert (again["unpaired"], len(again["problems"])) == (1, 3)


def listed(output: str, heading: str) -> list[str]:
    """The lines under a heading."""
    return [
        line.strip() for line in output.partition(f"{heading}:\n")[2].split("\n\n")[0].split("\n")
    ]


def test_every_pair_without_a_calibration_is_listed(
    capsys: Capture, folder: Path, analyst: FakeAnalyst
) -> None:
    (folder / "calibration.yml").rename(folder / "2026-05-25" / "calibration.yml")
    code, out, _ = run(capsys, folder, "--block", "North")
    assert code == ExitCode.OK and "1 added, 0 there before, 2 skipped." in out
    assert listed(out, "Problems") == [
        "2026-05-21/17_1_left.png: There is no calibration for 2026-05-21" + PUT_IT,
        "2026-05-21/18_1_left.png: There is no calibration for 2026-05-21" + PUT_IT,
    ]


def test_every_recording_that_cannot_be_used_is_listed(
    capsys: Capture, folder: Path, analyst: FakeAnalyst
) -> None:
    for name in ("9999_2023-05-19-22-10-00", "17_2023-05-20-22-10-00", "18_2023-05-20-22-10-00"):
        for seed, side in enumerate(("LEFT", "RIGHT")):
            write_image(folder / name / "COLOR" / f"{side}.png", seed)
    (folder / "calibration.yml").rename(folder / "2023_05_19.yml")
    code, out, _ = run(capsys, folder, "--block", "North")
    assert code == ExitCode.BAD_INPUT and "6 skipped" in out
    assert listed(out, "Problems")[:3] == [
        "17_2023-05-20-22-10-00/COLOR/LEFT.png: There is no calibration for 2023-05-20" + PUT_IT,
        "18_2023-05-20-22-10-00/COLOR/LEFT.png: There is no calibration for 2023-05-20" + PUT_IT,
        "2026-05-21/17_1_left.png: There is no calibration for 2026-05-21" + PUT_IT,
    ]
    assert "There is no tag 9999: they end at 586." in listed(out, "Problems")[-1]


def test_no_question_is_accepted_by_itself(
    capsys: Capture, folder: Path, analyst: FakeAnalyst, tmp_path: Path
) -> None:
    analyst.status = Status.CONFIRM
    code, out, _ = run(capsys, folder, "--block", "North")
    assert code == ExitCode.OK and "0 accepted, 3 to be decided on, 0 would" in out
    assert listed(out, "To be decided on") == [f"{s}_left.png: {QUESTION}" for s in THREE]
    assert "Two days" in out and "--accept-confirm" in out
    assert accepted(tmp_path) == 0
    code, out, _ = run(capsys, folder, "--block", "North", "--accept-confirm")
    assert code == ExitCode.OK and "0 added, 3 there before" in out
    assert accepted(tmp_path) == 3


@pytest.mark.parametrize(
    ("status", "expected"), [(Status.ACCEPT, 3), (Status.CONFIRM, 3), (Status.RETAKE, 0)]
)
def test_with_the_operators_word_questions_are_accepted(
    capsys: Capture,
    folder: Path,
    analyst: FakeAnalyst,
    tmp_path: Path,
    status: Status,
    expected: int,
) -> None:
    analyst.status = status
    code, out, _ = run(capsys, folder, "--block", "North", "--accept-confirm", "--json")
    found = json.loads(out)
    assert (code, found["accepted"], found["to_confirm"]) == (ExitCode.OK, expected, [])
    assert accepted(tmp_path) == expected


def accepted(tmp_path: Path) -> int:
    with closing(connect_read_only(tmp_path / "data/fieldcam.db")) as database:
        return len(rows(database, "SELECT 1 FROM decision_now WHERE action = 'accept'"))


def test_what_would_have_to_be_taken_again_is_listed(
    capsys: Capture, folder: Path, analyst: FakeAnalyst
) -> None:
    analyst.status = Status.RETAKE
    code, out, _ = run(capsys, folder, "--block", "North")
    assert code == ExitCode.OK and "3 would have to be taken again." in out
    assert listed(out, "To be taken again") == [
        f"{stem}_left.png: The picture is blurred." for stem in THREE
    ]
    assert run(capsys, folder, "--block", "North")[1].count("taken again") == 1


def test_a_folder_of_bad_pairs_only_is_bad_input(
    capsys: Capture, folder: Path, analyst: FakeAnalyst
) -> None:
    (folder / "calibration.yml").write_text("nonsense")
    code, out, err = run(capsys, folder, "--block", "North", "--json")
    assert code == ExitCode.BAD_INPUT
    assert len(json.loads(out)["problems"]) == 3
    assert err.splitlines()[-1].startswith("fieldcam: None of the pairs")


def mark_as_simulated(folder: Path, data: Path) -> None:
    data.mkdir()
    (data / "fieldcam-data.json").write_text('{"schema": 1, "kind": "simulated"}')


def put_a_file_there(folder: Path, data: Path) -> None:
    data.write_text("a file")


def damage_the_database(folder: Path, data: Path) -> None:
    data.mkdir()
    (data / "fieldcam.db").write_bytes(b"no database" * 1000)


@pytest.mark.parametrize("harm", [mark_as_simulated, put_a_file_there, damage_the_database])
def test_a_data_folder_that_cannot_be_used_is_one_sentence(
    capsys: Capture,
    tmp_path: Path,
    folder: Path,
    analyst: FakeAnalyst,
    harm: Callable[[Path, Path], None],
) -> None:
    harm(folder, tmp_path / "data")
    code, out, err = run(capsys, folder, "--block", "North", "--json")
    assert (code, out) == (ExitCode.STORAGE, "")
    assert len(err.splitlines()) == 1 and err.startswith("fieldcam: ")


def test_a_full_disk_ends_it_and_the_next_run_goes_on(
    capsys: Capture, folder: Path, analyst: FakeAnalyst, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = iter([None, StorageFull("Only 1 MB are free.")])

    def check(self: Space) -> None:
        if (error := next(answers)) is not None:
            raise error

    with monkeypatch.context() as patch:
        patch.setattr(Space, "check", check)
        code, out, err = run(capsys, folder, "--block", "North", "--json")
    assert (code, out) == (ExitCode.STORAGE, "")
    assert err.splitlines()[-1] == "fieldcam: Only 1 MB are free."
    assert document(capsys, folder)["known"] == 1


@pytest.mark.parametrize(
    "argv", [[], ["DIR"], ["DIR", "--block", " "], ["absent", "--block", "North"]], ids=" ".join
)
def test_wrong_usage_is_one_sentence(capsys: Capture, argv: list[str]) -> None:
    code, out, err = run(capsys, *argv)
    assert (code, out) == (ExitCode.BAD_INPUT, "")
    assert len(err.splitlines()) == 1


def test_an_empty_folder_is_bad_input(capsys: Capture, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    code, _, err = run(capsys, tmp_path / "empty", "--block", "North")
    assert code == ExitCode.BAD_INPUT and "holds no captures" in err
    assert not (tmp_path / "data").exists()


def test_a_terminal_sees_a_bar(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert list(progress("abc", 3, "letter")) == ["a", "b", "c"]
    drawn = capsys.readouterr().err.split("\r")
    assert drawn[1].startswith("[....")
    assert drawn[3] == "[####################..........] 2 of 3 letters\x1b[K"
    assert drawn[-1] == "\x1b[K"


def test_ctrl_c_leaves_what_was_imported(
    capsys: Capture, folder: Path, analyst: FakeAnalyst, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(analyst, "analyse", stop)
        assert run(capsys, folder, "--block", "North")[0] == 130
    found = document(capsys, folder)
    assert (found["added"], found["known"], found["analysed"]) == (2, 1, 3)


@pytest.mark.slow
def test_the_real_analysis_reads_a_png(capsys: Capture, tmp_path: Path) -> None:
    """With the shipped networks in a process of its own."""
    os.environ.pop("FIELDCAM_DATA")
    drawn, camera = self_test.drawn_pair(), self_test.CAMERA
    day = tmp_path / "season" / "2026-05-21"
    day.mkdir(parents=True)
    write_png(day / "17_1_left.png", drawn.left)
    write_png(day / "17_1_right.png", drawn.right)
    shift = -camera.focal_px * camera.baseline_mm / 1000
    (day / "calibration.yml").write_text(
        f"height: {camera.height_px}\nwidth: {camera.width_px}\n"
        f"P: [{camera.focal_px}, 0.0, {camera.cx_px}, {shift},"
        f" 0.0, {camera.focal_px}, {camera.cy_px}, 0.0, 0.0, 0.0, 1.0, 0.0]\n"
    )
    data = tmp_path / "data"
    code, out, _ = run(
        capsys, day.parent, "--block", "North", "--data", data, "--json"
    )  # fmt: skip
    assert code == ExitCode.OK
    assert json.loads(out)["analysed"] == 1
    database = connect_read_only(data / "fieldcam.db")
    (reading,) = rows(database, "SELECT tag_read FROM reading")
    assert reading["tag_read"] == self_test.TAG_ID


NOT_UTF_8 = os.fsdecode(b"caf\xe9 \x1b]0;owned\x07")
"""As an old card names it; with what would retitle a terminal."""


@pytest.mark.parametrize("where", ["the folder", "a stray", "a pair", "the data"])
def test_names_of_any_bytes_are_imported_and_do_not_command_the_terminal(
    capsys: Capture, folder: Path, analyst: FakeAnalyst, tmp_path: Path, where: str
) -> None:
    named = folder
    argv: list[object] = []
    if where == "the folder":
        named = folder.rename(folder.with_name(NOT_UTF_8))
    elif where == "a stray":
        (folder / NOT_UTF_8).mkdir()
        (folder / "2026-05-21" / f"{NOT_UTF_8}.png").write_bytes(b"x")
    elif where == "a pair":
        for side in ("LEFT", "RIGHT"):
            odd = folder / f"9_2026-05-21-10-00-00/COLOR/{NOT_UTF_8}_{side}.png"
            odd.parent.mkdir(parents=True, exist_ok=True)
            odd.write_bytes(b"x")
    else:
        argv = ["--data", tmp_path / NOT_UTF_8]
    code = main([*map(str, argv), "import", str(named), "--block", "North"])
    out, err = capsys.readouterr()
    assert code == ExitCode.OK, err
    assert "3 added" in out
    assert "\x1b" not in out + err and "\x07" not in out + err
    (out + err).encode()
