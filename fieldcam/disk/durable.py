"""Files that survive a crash at any moment: either whole under their name, or absent."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from shutil import rmtree
from uuid import uuid4

from fieldcam.errors import StorageError, StorageFull

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT)
_NO_FOLDER_SYNC = (errno.EINVAL, errno.ENOTSUP)


def write_durably(path: Path, content: bytes) -> None:
    """Write a file so that a crash leaves all of it or nothing.

    Temporary name, fsync, rename, fsync of the folder. The folder is made when
    it is missing.
    """
    temporary = part_of(path)
    try:
        make_folder(path.parent)
        _write_through(temporary, content)
        temporary.replace(path)
        fsync_folder(path.parent)
    except OSError as error:
        raise storage_error(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def part_of(path: Path) -> Path:
    """A new name beside it, for what is not whole yet; short, as its own may be the longest."""
    return path.with_name(f".{uuid4().hex}.part")


def write_folder_durably(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write a new folder so that a crash leaves all of its files or none.

    The same way as `write_durably`; nothing may lie under its name yet.
    """
    temporary = part_of(folder)
    try:
        make_folder(temporary)
        for name, content in files.items():
            _write_through(temporary / name, content)
        fsync_folder(temporary)
        temporary.rename(folder)
        fsync_folder(folder.parent)
    except OSError as error:
        rmtree(temporary, ignore_errors=True)
        raise storage_error(folder, error) from error


def _write_through(path: Path, content: bytes) -> None:
    with path.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, each durable in its parent."""
    missing = [f for f in (folder, *folder.parents) if not f.exists()]
    for each in reversed(missing):
        each.mkdir(exist_ok=True)
        fsync_folder(each.parent)


def storage_error(path: Path, error: OSError) -> StorageError:
    """The operator's sentence for an operating-system error while writing `path`."""
    if error.errno in _NO_ROOM:
        return StorageFull(f"No room is left to write {path}.", "Free some space and try again.")
    reason = error.strerror or str(error)
    return StorageError(
        f"{path} cannot be written: {reason}.",
        "Check the folder's owner and that its disk is not read-only.",
    )


def fsync_folder(folder: Path) -> None:
    """Make the names in a folder durable."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Some network file systems know no such thing, and keep names in an order of their own.
        if error.errno not in _NO_FOLDER_SYNC:
            raise
    finally:
        os.close(descriptor)
