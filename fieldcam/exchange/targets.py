"""Files that a command was told to write; what is wrong with them is found out first."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from fieldcam.disk.durable import storage_error, write_durably
from fieldcam.errors import BadInput, StorageError

_MISNAMED = {
    errno.EACCES,
    errno.EISDIR,
    errno.ENAMETOOLONG,
    errno.ENOENT,
    errno.ENOTDIR,
    errno.EPERM,
}
"""Another name helps; all else is the disk's."""


def check_target(path: Path, suffix: str, why: str) -> None:
    """Raise BadInput where a file of this ending could not be written."""
    if path.suffix.lower() != suffix:
        raise BadInput(f"{path} must end in {suffix}: {why}.")
    if path.is_dir():
        raise BadInput(f"{path} is a folder.")
    if not path.parent.is_dir():
        raise BadInput(f"There is no folder {path.parent} to write {path.name} into.")


def check_new_target(path: Path, suffix: str, why: str) -> None:
    """The same for a file that takes no other one's place."""
    check_target(path, suffix, why)
    if path.exists():
        raise BadInput(f"{path} is there already.", "Name a file that does not exist.")


def write_target(path: Path, content: bytes) -> None:
    """Write it, in place of what was there only once it is whole.

    Raises BadInput where the name is at fault, StorageError where the disk is.
    """
    try:
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            raise BadInput(f"{path} cannot be written: there is no folder {target.parent}.")
        if target.exists() and not target.is_file():
            target.write_bytes(content)  # a pipe or a device, whose place no file may take
        else:
            write_durably(target, content)
    except (OSError, StorageError) as error:
        raise _unwritable(path, error) from error


def _unwritable(path: Path, error: OSError | StorageError) -> BadInput | StorageError:
    cause = error if isinstance(error, OSError) else error.__cause__
    if isinstance(cause, OSError) and cause.errno in _MISNAMED:
        return BadInput(f"{path} cannot be written: {cause.strerror}.")
    return storage_error(path, error) if isinstance(error, OSError) else error
