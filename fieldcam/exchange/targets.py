"""Files that a command was told to write; what is wrong with them is found out first."""

from __future__ import annotations

from pathlib import Path

from fieldcam.errors import BadInput


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
    """Write it, over what was there."""
    try:
        path.write_bytes(content)
    except OSError as error:
        raise BadInput(f"{path} cannot be written: {error.strerror}.") from error
