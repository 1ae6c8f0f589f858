"""Nothing that was acknowledged is lost: killed writers, a full disk, a read-only one."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

ROUNDS = Path(__file__).with_name("store_rounds.py")
NAMESPACE = ["unshare", "--user", "--map-root-user", "--mount"]


def outcome(command: list[str]) -> dict[str, Any]:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def on_a_small_disk(folder: Path, size: str, *steps: str) -> dict[str, Any]:
    """Shell steps on a tmpfs that only they see; skips where the kernel forbids it."""
    mount = f"mount -t tmpfs -o size={size} tmpfs {folder}"
    if shutil.which("unshare") is None:
        pytest.skip("unshare is not installed")
    if subprocess.run([*NAMESPACE, "sh", "-c", mount], capture_output=True, check=False).returncode:
        pytest.skip("this kernel gives no user namespace in which to mount a small disk")
    return outcome([*NAMESPACE, "sh", "-ec", "\n".join((mount, *steps))])


def check_killed(folder: Path, rounds: int, note: Callable[[str], None]) -> None:
    result = outcome([sys.executable, str(ROUNDS), "kill", str(folder), str(rounds), "1"])
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


def test_a_full_disk_loses_nothing(tmp_path: Path) -> None:
    result = on_a_small_disk(tmp_path, "2m", f"{sys.executable} {ROUNDS} full {tmp_path}")
    assert (result["pictures"], result["rows"]) == ("StorageFull", "StorageFull")
    assert result["acknowledged"] > 0
    assert (result["lost"], result["broken"], result["gaps"]) == (0, 0, False)


def test_a_read_only_disk_is_said_and_can_be_read(tmp_path: Path) -> None:
    result = on_a_small_disk(
        tmp_path,
        "4m",
        f"{sys.executable} {ROUNDS} kill {tmp_path} 0 1 > /dev/null",
        f"mount -o remount,ro {tmp_path}",
        f"{sys.executable} {ROUNDS} read-only {tmp_path}",
    )
    assert "read-only" in result["hint"]
    assert result["devices"] == 1
