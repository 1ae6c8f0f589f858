"""The theme that was chosen last on this machine."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from fieldcam.disk.durable import write_durably
from fieldcam.errors import StorageError
from fieldcam.user_folders import UserFolder, user_folder


def remembered_theme() -> str | None:
    """Its name, whether it is known or not; None where nothing was chosen."""
    if (path := _path()) is not None:
        with suppress(OSError, UnicodeDecodeError):
            return path.read_text(encoding="utf-8").strip()
    return None


def remember_theme(name: str) -> None:
    """Where it cannot be kept, it is chosen anew next time."""
    if (path := _path()) is not None:
        with suppress(StorageError):
            write_durably(path, f"{name}\n".encode())


def _path() -> Path | None:
    folder = user_folder(UserFolder.STATE)
    return None if folder is None else folder / "fieldcam" / "theme"
