"""Follows the walk of an app in another process: reads the store when it has changed."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from time import time

from fieldcam.errors import FieldcamError
from fieldcam.session.aim.preview_file import PreviewFile, preview_folder
from fieldcam.session.events import Previewed
from fieldcam.session.state import WalkState
from fieldcam.session.viewing import VisitView
from fieldcam.store.queries.resuming import resume
from fieldcam.store.read_only import ReadOnlyStore, open_read_only

POLL_S = 0.3
"""Asking whether the database changed reads no page of it."""
RETRY_S = 2.0
OLD_S = 5.0
"""A preview of this age was left behind by a crash."""


@dataclass(frozen=True, slots=True)
class NothingToFollow:
    """There is no walk to show, and why; it is tried again."""

    sentence: str


@dataclass(frozen=True, slots=True)
class NotAiming:
    """Nobody looks through the camera any more."""


Sight = WalkState | NothingToFollow | Previewed | NotAiming


class Follower:
    """Tells each new state from a thread of its own, until it is closed."""

    def __init__(
        self,
        data: Path,
        tell: Callable[[Sight], None],
        poll_s: float = POLL_S,
        retry_s: float = RETRY_S,
    ) -> None:
        self._data, self._tell = data, tell
        self._poll_s, self._retry_s = poll_s, retry_s
        self._preview = PreviewFile(preview_folder(data))
        self._looked_s: float | None = None
        """When the look that was told last was written; None while nobody aims."""
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="follower", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Nothing is told once this returned."""
        self._closed.set()
        self._thread.join()

    def _run(self) -> None:
        try:
            while not self._closed.is_set():
                self._try()
        finally:
            # What was told last must not look like what is now.
            self._tell(NothingToFollow("The walk is not followed any more: open this page again."))

    def _try(self) -> None:
        try:
            with closing(open_read_only(self._data)) as store:
                self._follow(store)
        except (FieldcamError, OSError) as error:
            self._tell(NothingToFollow(str(error)))
            self._closed.wait(self._retry_s)

    def _follow(self, store: ReadOnlyStore) -> None:
        """Until the file is another one; raises what makes the store unreadable."""
        file, seen = store.file_id(), -1
        view: VisitView | None = None
        while not self._closed.is_set() and store.file_id() == file:
            if (changes := store.changes()) != seen:
                seen, view = changes, _view(store, view)
                self._tell(
                    NothingToFollow("No walk was begun yet.") if view is None else view.state()
                )
            self._look()
            self._closed.wait(self._poll_s)

    def _look(self) -> None:
        """Tell a new preview, and once that there is none any more."""
        written_s = self._preview.written_s()
        if written_s is None or abs(time() - written_s) > OLD_S:
            if self._looked_s is not None:
                self._looked_s = None
                self._tell(NotAiming())
        elif written_s != self._looked_s and (seen := self._preview.load()) is not None:
            self._looked_s = written_s
            self._tell(seen)


def _view(store: ReadOnlyStore, before: VisitView | None) -> VisitView | None:
    """The visit that is walked; the same view keeps the reading that it has decoded."""
    found = resume(store.database)
    if found is None:
        return None
    same = before is not None and before.visit == found.visit
    return before if same else VisitView(store, found.visit)
