"""The folders of whoever runs fieldcam, by the XDG Base Directory Specification."""

from __future__ import annotations

import os
from enum import Enum
from pathlib import Path

from fieldcam.errors import BadInput


class UserFolder(Enum):
    """The variable that names it, and where it lies below the home folder without that."""

    CACHE = "XDG_CACHE_HOME", ".cache"
    CONFIG = "XDG_CONFIG_HOME", ".config"
    DATA = "XDG_DATA_HOME", ".local/share"
    STATE = "XDG_STATE_HOME", ".local/state"


def user_folder(which: UserFolder) -> Path | None:
    """None where no home folder is known either, as for the user of a service."""
    variable, below = which.value
    named = Path(os.environ.get(variable, ""))
    if named.is_absolute():
        return named
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / below if home.is_absolute() else None


def temporary_folder() -> Path:
    """Nothing is tried out there, as Python's own does, which fails where the disk is full."""
    return Path(os.environ.get("TMPDIR") or "/tmp")


def expanded(path: Path) -> Path:
    """With `~` and `~name` as home folders; raises BadInput where there is no such one."""
    try:
        return path.expanduser()
    except RuntimeError as error:
        raise BadInput(
            f"No home folder is known for {path.parts[0]}.", "Write out the whole path."
        ) from error
