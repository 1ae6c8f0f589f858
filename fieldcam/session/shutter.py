"""The camera's thread: fires, saves, and says so; nothing else ever makes it wait."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from time import perf_counter

from fieldcam.camera.port import FlashStereoDevice
from fieldcam.errors import FieldcamError
from fieldcam.session.events import CameraReady, CameraTrouble, Saved, ShutterEvent, StorageTrouble
from fieldcam.store.captures import SavedCapture
from fieldcam.store.clock import now
from fieldcam.store.rows import EntryId
from fieldcam.store.store import Store
from fieldcam.values import Expectation

CLOSE_S = 5.0
"""How long closing waits for a picture that is being taken."""


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture to take."""

    expectation: Expectation
    view: int = 1
    retake_of: EntryId | None = None


class Shutter:
    """Owns the camera, which it opens again after it was lost."""

    def __init__(
        self,
        store: Store,
        visit: EntryId,
        open_camera: Callable[[], FlashStereoDevice],
        hear: Callable[[Shot | None, ShutterEvent], None],
        deadline_s: float,
    ) -> None:
        self._store, self._visit = store, visit
        self._open_camera, self._hear, self._deadline_s = open_camera, hear, deadline_s
        self._camera: FlashStereoDevice | None = None
        self._shots: SimpleQueue[Shot | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self._thread.start()

    def fire(self, shot: Shot) -> None:
        """Take it as soon as those before it are taken."""
        self._shots.put(shot)

    def close(self) -> None:
        """Take what was asked for, give the camera back and end."""
        self._shots.put(None)
        self._thread.join(CLOSE_S)

    def _run(self) -> None:
        self._ready()
        while (shot := self._shots.get()) is not None:
            self._take(shot)
        self._let_go()

    def _ready(self) -> None:
        try:
            self._camera = self._open_camera()
        except FieldcamError as error:
            self._hear(None, CameraTrouble(error))
        else:
            self._hear(None, CameraReady())

    def _take(self, shot: Shot) -> None:
        """A full disk is found out before the flash, while nothing can be lost."""
        try:
            self._store.space.check()
        except FieldcamError as error:
            self._hear(shot, StorageTrouble(error))
            return
        try:
            self._camera = self._camera or self._open_camera()
            shutter, raw = now(), self._camera.capture(self._deadline_s)
        except FieldcamError as error:
            self._let_go()
            self._hear(shot, CameraTrouble(error))
            return
        started = perf_counter()
        try:
            saved: SavedCapture = self._store.save(
                raw,
                visit=self._visit,
                tag_expected=shot.expectation.tag_id,
                view=shot.view,
                retake_of=shot.retake_of,
                shutter=shutter,
            )
        except FieldcamError as error:
            self._hear(shot, StorageTrouble(error))
            return
        duration_ms = (perf_counter() - started) * 1000
        self._hear(shot, Saved(saved, shot.expectation.tag_id, duration_ms))

    def _let_go(self) -> None:
        if self._camera is not None:
            self._camera.close()
            self._camera = None
