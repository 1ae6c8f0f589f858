"""Looks at all stored images once while the app runs: a start has no time for old ones.

In a thread of its own, which takes its time: a few files a second, so that neither a key
nor the analysis waits for it.
"""

from __future__ import annotations

import threading
from contextlib import closing
from pathlib import Path

from fieldcam.errors import StorageError
from fieldcam.session.events import Damaged, Listener
from fieldcam.store.connection import connect_read_only
from fieldcam.store.objects import Objects
from fieldcam.store.recovery.integrity import FileProblem, rehash_old
from fieldcam.store.recovery.startup import TO_DO
from fieldcam.store.store import DATABASE_NAME

PAUSE_S = 0.1


class OldFiles:
    """Tells each picture that is damaged or missing, until it is closed or done."""

    def __init__(self, folder: Path, tell: Listener, pause_s: float = PAUSE_S) -> None:
        self._folder, self._tell, self._pause_s = folder, tell, pause_s
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="old files", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Nothing is told once this returned."""
        self._closed.set()
        self._thread.join()

    def _run(self) -> None:
        try:
            with closing(connect_read_only(self._folder / DATABASE_NAME)) as database:
                for found in rehash_old(database, Objects(self._folder)):
                    if self._closed.wait(self._pause_s):
                        return
                    if found is not None:
                        self._tell(Damaged(_sentence(found)))
        except StorageError:
            return  # whoever writes there says what is wrong with the database


def _sentence(problem: FileProblem) -> str:
    return f"An old image file is {problem.fault}, of {problem.belongs_to}. {TO_DO}"
