"""Files that a command was told to write: whole, or as they were before."""

from __future__ import annotations

import errno
import os
import stat
import threading
from pathlib import Path

import pytest

from fieldcam.disk.targets import write_target
from fieldcam.errors import BadInput, ExitCode, FieldcamError, StorageError, StorageFull


def fail_with(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """Let every file turn out to be unwritable once all of it should be on the disk."""

    def fail(descriptor: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", fail)


@pytest.mark.parametrize("before", [None, b"old"])
@pytest.mark.parametrize(
    ("number", "error"),
    [
        (errno.ENOSPC, StorageFull),
        (errno.EDQUOT, StorageFull),
        (errno.EFBIG, StorageError),
        (errno.EIO, StorageError),
        (errno.EROFS, StorageError),
        (errno.EACCES, BadInput),
    ],
)
def test_what_cannot_be_written_leaves_what_was_there(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    number: int,
    error: type[FieldcamError],
    before: bytes | None,
) -> None:
    path = tmp_path / "out.csv"
    if before is not None:
        path.write_bytes(before)
    fail_with(monkeypatch, number)
    with pytest.raises(error) as raised:
        write_target(path, b"new")
    full = number in (errno.ENOSPC, errno.EDQUOT)
    assert (
        raised.value.exit_code == (ExitCode.BAD_INPUT if error is BadInput else ExitCode.STORAGE)
        and ("No room" in str(raised.value)) is full
    )
    left = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    assert left == ({} if before is None else {"out.csv": before})


def test_a_missing_folder_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no folder"):
        write_target(tmp_path / "missing/out.csv", b"new")
    assert list(tmp_path.iterdir()) == []


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real.csv").write_bytes(b"old")
    (tmp_path / "link.csv").symlink_to("real.csv")
    write_target(tmp_path / "link.csv", b"new")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "real.csv").read_bytes() == b"new"


def test_a_pipe_stays_a_pipe(tmp_path: Path) -> None:
    pipe, heard = tmp_path / "out.csv", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: heard.append(pipe.read_bytes()))
    reader.start()
    write_target(pipe, b"new")
    reader.join(timeout=10)
    assert heard == [b"new"] and stat.S_ISFIFO(pipe.stat().st_mode)


def test_the_longest_name_can_be_written(tmp_path: Path) -> None:
    write_target(tmp_path / f"{'x' * 251}.csv", b"new")
    with pytest.raises(BadInput, match="too long"):
        write_target(tmp_path / f"{'x' * 252}.csv", b"new")


def test_a_network_share_that_syncs_no_folder_takes_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    sync = os.fsync

    def only_files(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", only_files)
    write_target(tmp_path / "out.csv", b"new")
    assert (tmp_path / "out.csv").read_bytes() == b"new"
