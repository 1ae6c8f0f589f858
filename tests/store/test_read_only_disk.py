"""A data folder on a disk that takes no writing is opened to look, and nothing else."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from grown_walks import grown_field
from stored_walks import FIRST_DAY, MadeWalk, facts_without_rows, small_store

from fieldcam.errors import StorageError
from fieldcam.store.connection import connect_read_only, rows
from fieldcam.store.folder import DataKind
from fieldcam.store.migrations import steps
from fieldcam.store.read_only import open_read_only
from fieldcam.store.rows.walk import Visit
from fieldcam.store.store import open_store


@contextmanager
def read_only(folder: Path) -> Iterator[Path]:
    """The folder as a disk of its own that the kernel lets nobody write."""
    place = folder.with_name(f"{folder.name}-mounted")
    place.mkdir()
    try:
        subprocess.run(["mount", "--bind", folder, place], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("only root may mount")
    try:
        subprocess.run(["mount", "-o", "remount,ro,bind", place], check=True)
        yield place
    finally:
        subprocess.run(["umount", place], check=True)


def pictures(folder: Path) -> int:
    with closing(open_read_only(folder)) as store:
        return len(rows(store.database, "SELECT id FROM capture"))


def test_a_whole_folder_is_looked_at(tmp_path: Path) -> None:
    folder = grown_field(tmp_path / "data")
    with read_only(folder) as place:
        assert pictures(place) == 4
        with pytest.raises(StorageError, match="`fieldcam follow`"):
            open_store(place, DataKind.FIELD)


def test_the_log_of_a_crash_is_looked_at_too(tmp_path: Path) -> None:
    with small_store(tmp_path / "data") as store:
        walk = MadeWalk(store)
        walk.accept(walk.visit(), 11)
        left = shutil.ignore_patterns("*-shm")
        shutil.copytree(tmp_path / "data", tmp_path / "card", ignore=left)
    with read_only(tmp_path / "card") as place:
        with pytest.raises(StorageError):
            connect_read_only(place / "fieldcam.db")
        assert pictures(place) == 1


def test_an_older_form_is_looked_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("fieldcam.store.migrations.steps", lambda: steps()[:3])
        with small_store(tmp_path / "data") as store:
            walk = MadeWalk(store)
            # Its pictures had no facts beside them, and its visits no day said anew.
            patch.setattr("fieldcam.store.store.facts_of", facts_without_rows)
            walk.take(store.append(Visit(walk.block, FIRST_DAY))[0], 11)
    with pytest.raises(StorageError, match="older fieldcam"):
        pictures(tmp_path / "data")
    with read_only(tmp_path / "data") as place:
        assert pictures(place) == 1
