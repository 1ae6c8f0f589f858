"""Where data lies: `--data DIR`, else FIELDCAM_DATA, else the user's data folder.

Simulated captures have a folder of their own, and a marker file says which kind
a folder is, so that the two can never mix.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from fieldcam.disk.durable import write_durably
from fieldcam.errors import BadInput, StorageError
from fieldcam.user_folders import UserFolder, expanded, user_folder

DATA_VARIABLE = "FIELDCAM_DATA"
MARKER_NAME = "fieldcam-data.json"
DATABASE_NAME = "fieldcam.db"


class DataKind(StrEnum):
    """What a data folder may hold."""

    FIELD = "field"
    SIMULATED = "simulated"


@dataclass(frozen=True, slots=True)
class DataFolder:
    """A folder that fieldcam may write to."""

    path: Path
    kind: DataKind


def data_path(option: Path | None, kind: DataKind = DataKind.FIELD) -> Path:
    """The data folder's path; nothing is made, but what cannot be a folder is refused."""
    path = data_path_if_any(option, kind)
    if path is None:
        raise StorageError(
            "This user has no home folder to keep data in.",
            f"Name a folder with --data or {DATA_VARIABLE}.",
        )
    return _no_file(path)


def data_path_if_any(option: Path | None, kind: DataKind = DataKind.FIELD) -> Path | None:
    """For what only looks there for networks or settings; None where no folder is known."""
    if option is not None:
        return _folder(option)
    if variable := os.environ.get(DATA_VARIABLE):
        named = _folder(Path(variable))
        return named if kind is DataKind.FIELD else _no_file(demo_beside(named))
    name = "fieldcam" if kind is DataKind.FIELD else "fieldcam-demo"
    user = user_folder(UserFolder.DATA)
    return None if user is None else user / name


def demo_beside(path: Path) -> Path:
    """Where simulated captures lie that are asked for from this data folder."""
    return path.with_name(f"{path.name}-demo")


def open_data_folder(path: Path, kind: DataKind) -> DataFolder:
    """The data folder at `path`, made and marked when it is new."""
    marker = path / MARKER_NAME
    found = _read_kind(marker)
    if found is None:
        write_durably(marker, json.dumps({"schema": 1, "kind": kind}).encode() + b"\n")
    elif found is not kind:
        raise StorageError(
            f"{path} holds {found} captures and takes no {kind} ones.",
            "Name another folder with --data.",
        )
    return DataFolder(path, kind)


def known_data_folder(path: Path) -> DataFolder:
    """The data folder at `path`, whatever kind it is; nothing is made."""
    check_marker(path)
    found = _read_kind(path / MARKER_NAME)
    if found is None:
        raise StorageError(f"There is no data folder at {path}.", "Name another with --data.")
    return DataFolder(path, found)


def check_marker(path: Path) -> None:
    """Raises StorageError where a folder holds pictures, and nothing says of which kind."""
    if not (path / "objects").is_dir() or _read_kind(path / MARKER_NAME) is not None:
        return
    database = " and a database" if (path / DATABASE_NAME).exists() else ""
    raise StorageError(
        f"{path} holds pictures{database}, but no {MARKER_NAME}, the file that says which kind they"
        " are.",
        "If the folder was copied, copy this file too; if it is lost, `fieldcam recover` makes it"
        " anew.",
    )


def kind_of(path: Path) -> DataKind | None:
    """What the marker of a data folder says; None where it has none."""
    return _read_kind(path / MARKER_NAME)


def _folder(named: Path) -> Path:
    try:
        return _no_file(expanded(named).resolve())
    except RuntimeError as error:  # Python's word for links that lead in a circle
        raise BadInput(f"{named} is a link that leads to itself.") from error
    except OSError as error:
        raise BadInput(f"{named} cannot be used: {error.strerror}.") from error


def _no_file(path: Path) -> Path:
    with suppress(PermissionError):  # whoever reads or writes there says so
        there = next(each for each in (path, *path.parents) if each.exists())
        if not there.is_dir():
            raise StorageError(f"{there} is a file, not a folder.", "Name a folder with --data.")
    return path


_MAKE_ANEW = "Delete it, then `fieldcam recover` makes it anew."


def _read_kind(marker: Path) -> DataKind | None:
    try:
        content = json.loads(marker.read_bytes())
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StorageError(f"{marker} cannot be read: {error.strerror}.") from error
    except ValueError as error:
        raise StorageError(f"{marker} cannot be read: {error}.", _MAKE_ANEW) from error
    if not isinstance(content, dict) or content.get("kind") not in tuple(DataKind):
        raise StorageError(f"{marker} does not say what kind of data its folder holds.", _MAKE_ANEW)
    return DataKind(content["kind"])
