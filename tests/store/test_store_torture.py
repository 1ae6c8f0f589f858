"""Nothing that was acknowledged is lost: killed writers, a full disk, a read-only one."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from torture import faults, kills, power_cuts
from torture.inspection import Losses
from torture.small_disks import on_a_small_disk, outcome, why_not

ROUNDS = f"{sys.executable} -m torture.store_rounds"


@pytest.fixture
def small_disk(tmp_path: Path) -> Path:
    """Where a small disk may be mounted."""
    if reason := why_not(tmp_path):
        pytest.skip(reason)
    return tmp_path


def check_killed(folder: Path, rounds: int, note: Callable[[str], None]) -> None:
    result = outcome([*ROUNDS.split(), "kill", str(folder), str(rounds), "1"])
    note(
        f"store: {rounds} kills, {result['acknowledged']} pictures saved,"
        f" {result['lost']} lost, {result['taken_up']} more taken up from their files."
    )
    assert result["acknowledged"] > 0
    assert (result["lost"], result["broken"], result["gaps"]) == (0, 0, False)


@pytest.fixture
def memory_folder(tmp_path: Path) -> Iterator[Path]:
    """A folder in memory where there is one: more happens between two kills there."""
    memory = Path("/dev/shm")
    if not os.access(memory, os.W_OK):
        yield tmp_path
        return
    with TemporaryDirectory(dir=memory) as folder:
        yield Path(folder)


def test_a_killed_writer_loses_nothing(memory_folder: Path, note: Callable[[str], None]) -> None:
    check_killed(memory_folder, 25, note)


@pytest.mark.slow
def test_a_writer_killed_a_thousand_times_loses_nothing(
    tmp_path: Path, note: Callable[[str], None]
) -> None:
    check_killed(tmp_path, 1000, note)


def test_a_full_disk_loses_nothing(small_disk: Path) -> None:
    result = on_a_small_disk(small_disk, "2m", f"{ROUNDS} full {small_disk}")
    assert (result["pictures"], result["rows"]) == ("StorageFull", "StorageFull")
    assert result["acknowledged"] > 0
    assert (result["lost"], result["broken"], result["gaps"]) == (0, 0, False)


def test_a_disk_that_is_full_at_the_start_can_be_read(small_disk: Path) -> None:
    result = on_a_small_disk(small_disk, "2m", f"{ROUNDS} begin-full {small_disk}")
    assert result["opened"] and result["left"] > 0
    assert result["loose"] == result["left"]


def test_a_read_only_disk_is_said_and_can_be_read(small_disk: Path) -> None:
    result = on_a_small_disk(
        small_disk,
        "4m",
        f"{ROUNDS} kill {small_disk} 0 1 > /dev/null",
        f"mount -o remount,ro {small_disk}",
        f"{ROUNDS} read-only {small_disk}",
    )
    assert "read-only" in result["hint"]
    assert result["devices"] == 1


def test_a_walk_on_a_disk_that_fills_up_loses_nothing_and_goes_on(small_disk: Path) -> None:
    program = f"{sys.executable} -m torture.full_disk {small_disk} 2 1"
    result = on_a_small_disk(small_disk, "24m", program)
    assert result["said"]["StorageTrouble"] > 0
    assert result["did_not_go_on"] == 0
    assert Losses(**result["losses"]).none


def test_a_killed_app_loses_nothing_and_gives_the_terminal_back(
    memory_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[1]))
    tally = kills.rounds(memory_folder, 4, seed=1)
    assert tally.kills.total() >= 4
    assert tally.terminals_broken == 0
    assert tally.losses.none


@pytest.mark.slow
def test_an_analysis_that_always_fails_costs_no_picture(
    memory_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[1]))
    found = faults.suffer(memory_folder, 20)
    assert (found.unanswered, found.gave_up) == (0, False)
    assert found.losses.none


@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not installed")
def test_a_power_cut_loses_nothing(memory_folder: Path) -> None:
    found = power_cuts.recorded_and_cut(memory_folder / "cuts", 1, every=60, seed=1)
    assert found.states > 10
    assert found.losses.pictures > 0
    assert found.losses.none


@pytest.mark.slow
@pytest.mark.parametrize("flaw", ["rows", "images", "names"])
@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not installed")
def test_a_missing_sync_is_found(memory_folder: Path, flaw: str) -> None:
    found = power_cuts.recorded_and_cut(memory_folder / "cuts", 2, every=20, seed=1, flaw=flaw)
    assert not found.losses.none
