"""Bounds on files from elsewhere: their kind, their length, and what reading them costs."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from fieldcam.errors import BadInput, CalibrationInvalid
from fieldcam.foreign.bounds import CALIBRATION, MIB, Bound
from fieldcam.foreign.child import read_in_child
from fieldcam.foreign.files import read_foreign

SMALL = Bound("note", 10)
HERE = Path(__file__).resolve().parent
TIGHT = Bound("note", 10, most_cpu_s=1, most_memory_bytes=100 * MIB)


@pytest.fixture(autouse=True)
def readers_of_this_module(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a child finds them."""
    folders = (HERE.parents[1], HERE.parent, HERE)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, folders)))


def test_a_file_is_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "note"
    path.write_bytes(b"0123456789")
    assert read_foreign(path, SMALL) == b"0123456789"


def test_a_longer_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "note"
    path.write_bytes(b"0123456789a")
    with pytest.raises(BadInput, match="too large for a note"):
        read_foreign(path, SMALL)


def test_what_is_no_file_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    cases = {
        Path("/dev/zero"): "pipe or a device",
        pipe: "pipe or a device",
        tmp_path: "is a folder, not a calibration file",
        tmp_path / "none": "There is no calibration file",
        tmp_path / "a\0b": "cannot be read",
        tmp_path / ("n" * 300): "cannot be read",
    }
    for path, sentence in cases.items():
        with pytest.raises(CalibrationInvalid, match=sentence):
            read_foreign(path, CALIBRATION)


def length_of(path: Path) -> int:
    sys.stdout.write("what a library prints is no answer")
    sys.stdout.flush()
    return len(path.read_bytes())


def refuses(path: Path) -> int:
    raise BadInput(f"{path.name} is none.", "Give another.")


def never_ends(path: Path) -> int:
    while True:
        pass


def hoards(path: Path) -> int:
    return len(b"x" * (200 * MIB))


def breaks(path: Path) -> int:
    os.abort()


def test_a_child_gives_what_its_reader_gives(tmp_path: Path) -> None:
    path = tmp_path / "note"
    path.write_bytes(b"12345")
    assert read_in_child(length_of, path, SMALL) == 5
    with pytest.raises(BadInput) as caught:
        read_in_child(refuses, path, SMALL)
    assert (caught.value.message, caught.value.hint) == ("note is none.", "Give another.")


@pytest.mark.parametrize(
    ("reader", "sentence"),
    [(never_ends, "longer to read"), (hoards, "unpacks to more"), (breaks, "broke off")],
)
def test_a_reader_that_costs_too_much_is_ended(
    reader: Callable[[Path], int], sentence: str, tmp_path: Path
) -> None:
    began_s = time.monotonic()
    with pytest.raises(BadInput, match=sentence):
        read_in_child(reader, tmp_path / "note", TIGHT)
    assert time.monotonic() - began_s < 2 * TIGHT.most_cpu_s * 6


def test_a_module_beside_the_file_is_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pickle.py").write_text("raise SystemExit(9)")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "note").write_bytes(b"1")
    assert read_in_child(length_of, Path("note"), SMALL) == 1
