"""The camera's thread: fires, saves, and says so; nothing else ever makes it wait.

While somebody aims it looks through the camera now and then, and while the camera
is lost it tries to open it again.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from queue import Empty, SimpleQueue
from time import perf_counter

from fieldcam.camera.port import FlashStereoDevice
from fieldcam.errors import FieldcamError, FlashMissing, FrameIncomplete
from fieldcam.session.aim.aiming import Aiming
from fieldcam.session.calibrating import CameraCalibration
from fieldcam.session.events import CameraReady, CameraTrouble, Saved, ShutterEvent, StorageTrouble
from fieldcam.session.viewing import Place
from fieldcam.store.captures import SavedCapture
from fieldcam.store.clock import Moment, now
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.walk import Event, EventKind
from fieldcam.store.store import Store
from fieldcam.values import Expectation, RawPair

PREVIEW_EVERY_S = 0.5
PREVIEW_DEADLINE_S = 1.0
REOPEN_EVERY_S = 2.0
ATTEND_EVERY_S = 2.0
"""How soon a pulled cable is said, and the head's own button works again."""
CLOSE_S = 5.0
"""How long closing waits for a picture that is being taken."""


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture to take."""

    expectation: Expectation
    view: int = 1
    retake_of: EntryId | None = None
    tree: EntryId | None = None
    """Where it was asked for; a new tag joins this tree."""

    @property
    def place(self) -> Place:
        """Where the operator stood when it was asked for."""
        return self.expectation.tag_id, self.tree


class Shutter:
    """Owns the camera, which it opens again after it was lost; takes one picture at a time."""

    def __init__(
        self,
        store: Store,
        visit: EntryId,
        open_camera: Callable[[], FlashStereoDevice],
        hear: Callable[[Shot | None, ShutterEvent], None],
        pressed: Callable[[], None],
        aiming: Aiming,
        deadline_s: float,
        calibration: CameraCalibration | None = None,
    ) -> None:
        """`pressed` is called when the camera's own shutter is.

        `calibration` goes with each picture, where the analysis does not know the camera.
        """
        self._store, self._visit = store, visit
        self._open_camera, self._hear, self._deadline_s = open_camera, hear, deadline_s
        self._pressed, self._aiming, self._calibration = pressed, aiming, calibration
        self._camera: FlashStereoDevice | None = None
        self._looking, self._complaint, self._missed = False, "", ""
        self._lock = threading.Lock()
        self._waiting: Shot | None = None
        """What was asked for and has not begun."""
        self.moved_to: Place | None = None
        """Where the operator went while a picture was being taken; set under the store's lock."""
        self._orders: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self._thread.start()

    def fire(self, shot: Shot) -> None:
        """Take it as soon as the camera is there for it."""
        with self._lock:
            self._waiting = shot
        self._orders.put(partial(self._take, shot))

    def drop(self) -> bool:
        """Take nothing that has not begun; whether there was such a thing."""
        with self._lock:
            dropped, self._waiting = self._waiting is not None, None
        return dropped

    def start_preview(self) -> None:
        """Look through the camera now and then, until told to stop."""
        self._orders.put(self._start_looking)

    def stop_preview(self) -> None:
        self._orders.put(self._stop_looking)

    def close(self) -> None:
        """Take what was asked for, give the camera back and end."""
        self._orders.put(None)
        self._thread.join(CLOSE_S)

    def _run(self) -> None:
        try:
            self._open()
        except FieldcamError as error:
            self._hear(None, CameraTrouble(error))
        while (order := self._next()) is not None:
            order()
        self._stop_looking()
        self._let_go()

    def _next(self) -> Callable[[], None] | None:
        """The next order; while there is none, what is done meanwhile."""
        meanwhile, pause_s = self._meanwhile()
        try:
            return self._orders.get(timeout=pause_s)
        except Empty:
            return meanwhile

    def _meanwhile(self) -> tuple[Callable[[], None], float]:
        if self._camera is None:
            return self._reopen, REOPEN_EVERY_S
        if self._looking:
            return self._look, PREVIEW_EVERY_S
        return self._attend, ATTEND_EVERY_S

    def _open(self) -> FlashStereoDevice:
        camera = self._open_camera()
        try:
            camera.watch_shutter(self._pressed)
        except FieldcamError:
            # Nobody else would give it back, and it could not be opened again.
            camera.close()
            raise
        self._camera = camera
        self._hear(
            None, CameraReady(self._missed, (*camera.notes, *self._calibration_note(camera)))
        )
        self._missed = ""
        return camera

    def _calibration_note(self, camera: FlashStereoDevice) -> tuple[str, ...]:
        if self._calibration is None:
            return ()
        problem = self._calibration.problem or self._calibration.doubt(camera.serials)
        return (problem,) if problem else ()

    def _reopen(self) -> None:
        with suppress(FieldcamError):
            self._open()

    def _attend(self) -> None:
        if self._camera is None:
            return
        try:
            self._camera.attend()
        except FieldcamError as error:
            self._lose(error)
        else:
            self._complaint = ""

    def _start_looking(self) -> None:
        self._looking = True
        self._look()

    def _stop_looking(self) -> None:
        self._looking = False
        self._aiming.stop()

    def _look(self) -> None:
        if self._camera is None:
            return
        try:
            preview = self._camera.preview(PREVIEW_DEADLINE_S)
        except FieldcamError as error:
            self._lose(error)
            return
        if preview is not None:
            self._complaint = ""
            self._aiming.show(preview)

    def _lose(self, error: FieldcamError) -> None:
        """Said first: a camera that is silent takes seconds to be given back."""
        self._complain(error)
        self._let_go()

    def _complain(self, error: FieldcamError) -> None:
        """Once for each trouble: a camera that opens and then fails does so every time."""
        if error.message != self._complaint:
            self._hear(None, CameraTrouble(error))
        self._complaint = error.message

    def _take(self, shot: Shot) -> None:
        """A full disk is found out before the flash, while nothing can be lost."""
        if self._waiting is not shot:
            return
        try:
            self._store.space.check()
        except FieldcamError as error:
            self._hear(shot, StorageTrouble(error))
            return
        try:
            camera = self._camera or self._open()
            if not self._begins(shot):
                return  # it was dropped while the camera was opened
            shutter, raw = now(), camera.capture(self._deadline_s)
        except (FrameIncomplete, FlashMissing) as error:
            self._hear(shot, CameraTrouble(error, lost=False))
            return
        except FieldcamError as error:
            self._missed = error.message
            self._hear(shot, CameraTrouble(error))
            self._let_go()
            return
        self._complaint = ""
        started = perf_counter()
        try:
            saved = self._save(shot, raw, shutter)
        except FieldcamError as error:
            self._hear(shot, StorageTrouble(error))
            return
        duration_ms = (perf_counter() - started) * 1000
        self._hear(shot, Saved(saved, shot.expectation.tag_id, duration_ms))

    def _begins(self, shot: Shot) -> bool:
        """Whether it is still wanted; from here on it is finished."""
        with self._lock:
            wanted, self._waiting = self._waiting is shot, None
        return wanted

    def _save(self, shot: Shot, raw: RawPair, shutter: Moment) -> SavedCapture:
        """Under the cluster where it was fired."""
        return self._store.save(
            raw,
            visit=self._visit,
            tag_expected=shot.expectation.tag_id,
            view=shot.view,
            retake_of=shot.retake_of,
            shutter=shutter,
            tree=shot.tree,
            calibration=None if self._calibration is None else self._calibration.name,
            followed_by=self._where_the_operator_went,
        )

    def _where_the_operator_went(self) -> tuple[Event, ...]:
        """A picture that comes late takes nobody back to its cluster."""
        if self.moved_to is None:
            return ()
        tag_id, tree = self.moved_to
        return (Event(EventKind.WENT_TO, self._visit, tag_id=tag_id, tree=tree),)

    def _let_go(self) -> None:
        if self._camera is not None:
            self._camera.close()
            self._camera = None
