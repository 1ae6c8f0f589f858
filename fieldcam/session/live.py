"""The live walk, as a library: any screen, or a test, drives it.

Two threads: the camera's takes and saves pictures (`Shutter`), the walk's own
keeps everything else, so that neither a slow exposure nor a slow analysis holds
up a decision. Commands return at once; what came of them is told to one
listener, in the threads of the walk, which must only pass it on.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from queue import SimpleQueue

from fieldcam.analysis.status import AnalysisStatus
from fieldcam.camera.port import DEADLINE_S, FlashStereoDevice
from fieldcam.errors import FieldcamError, ReadingDamaged
from fieldcam.session import commands as c
from fieldcam.session import events
from fieldcam.session.aim.aiming import Aiming
from fieldcam.session.aim.preview_file import PreviewFile, preview_folder
from fieldcam.session.calibrating import CameraCalibration
from fieldcam.session.deciding.decide import decide
from fieldcam.session.deciding.shots import due_shot, second_shot
from fieldcam.session.doubt import Doubtful, NewDay, NotNow
from fieldcam.session.old_files import OldFiles
from fieldcam.session.reading import Analysis, Readings
from fieldcam.session.set_up.today import AnotherDay
from fieldcam.session.shutter import Shot, Shutter
from fieldcam.session.state import CameraState
from fieldcam.session.viewing import WalkView
from fieldcam.store.rows.row import EntryId
from fieldcam.store.seals import WHY
from fieldcam.store.store import Store

_Ordered = c.Shoot | c.SecondView | c.RestartAnalysis | c.Refresh | c.Writing


def _same_day() -> None:
    """The visit's day is not the clock's to say."""


class LiveWalk:
    """One visit in an open store; runs from the moment it is made until `close`."""

    def __init__(
        self,
        store: Store,
        visit: EntryId,
        open_camera: Callable[[], FlashStereoDevice],
        start_analysis: Callable[[Callable[[AnalysisStatus], None]], Analysis],
        listener: events.Listener,
        deadline_s: float = DEADLINE_S,
        calibration: CameraCalibration | None = None,
        another_day: Callable[[], AnotherDay | None] = _same_day,
    ) -> None:
        """`start_analysis` is given what wants to hear of the analysis's status.

        `calibration` goes with each picture; None where the analysis knows the camera.
        `another_day` says where there is a question before a picture: whether a visit begins.
        """
        self._store, self._tell, self._another_day = store, listener, another_day
        self._view = WalkView(store, visit)
        self._inbox: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._camera = CameraState.OPENING
        self._in_flight: Shot | None = None
        """The picture that was asked for, until it is saved or missed."""
        self._camera_trouble = ""
        self._camera_notes: tuple[str, ...] = ()
        self._analysis = start_analysis(lambda status: self.do(c.Refresh()))
        self._calibration = calibration
        self._readings = Readings(
            self._view,
            self._analysis,
            self._inbox.put,
            listener,
            *(() if calibration is None else (calibration.completed,)),
        )
        self._inbox.put(partial(self._readings.take_up, again=False))
        file = PreviewFile(preview_folder(store.folder.path))
        self._old_files = OldFiles(store.folder.path, listener)
        self._aiming = Aiming(file, self._analysis, listener, calibration)
        self._thread = threading.Thread(target=self._run, name="walk", daemon=True)
        self._thread.start()
        self._shutter = Shutter(
            store,
            visit,
            open_camera,
            self._heard,
            partial(self.do, c.Shoot()),
            self._aiming,
            deadline_s,
            calibration,
        )

    def do(self, command: c.Command) -> None:
        """Returns at once; all but the preview is done in the walk's thread."""
        match command:
            case c.StartPreview():
                self._shutter.start_preview()
            case c.StopPreview():
                self._shutter.stop_preview()
            case _:
                self._inbox.put(partial(self._obey, command))

    def close(self) -> None:
        """Save what was asked for, then end; pictures without a reading wait in the store."""
        self._old_files.close()
        self._shutter.close()
        self._analysis.close()
        self._inbox.put(None)
        self._thread.join()

    def _obey(self, command: _Ordered, insist: bool = False) -> None:
        try:
            done = self._carried_out(command, insist)
        except Doubtful as doubt:
            again = partial(self._obey, command, insist=True)
            self._tell(events.Doubted(doubt.message, partial(self._inbox.put, again)))
        except NotNow as refusal:
            self._tell(events.Refused(refusal.message, refusal.instead))
        except NewDay as question:
            self._tell(events.DayDoubted(question.day))
        else:
            if done:
                self._tell(events.Done(done))

    def _carried_out(self, command: _Ordered, insist: bool) -> str:
        match command:
            case c.Shoot():
                self._check_shutter()
                return self._sent(due_shot(self._view, insist))
            case c.SecondView():
                self._check_shutter()
                return self._sent(second_shot(self._view))
            case c.RestartAnalysis():
                self._analysis.restart()
                self._readings.take_up(again=True)
                return "The analysis was started again."
            case c.Refresh():
                return ""
            case _:
                return self._written(command, insist)

    def _written(self, command: c.Writing, insist: bool) -> str:
        """The decision and what follows from it are durable together."""
        if isinstance(command, c.OnShown):
            self._check_shown()
        done = self._store.together(self._decided, command, insist)
        if isinstance(command, c.CorrectTag):
            self._readings.read_as(command.tag_id)
        return done

    def _decided(self, command: c.Writing, insist: bool) -> str:
        """Whoever has gone on wants no picture that has not begun, nor to be taken back by one."""
        before = self._view.place()
        done = decide(self._view, command, insist)
        here, shot = self._view.place(), self._in_flight
        if shot is None or here == before:
            return done
        if here == shot.place:
            self._shutter.moved_to = None
            return done
        self._shutter.moved_to = here
        if not self._shutter.drop():
            return done
        self._in_flight = None
        return f"{done} The picture of {shot.named} that waited was not taken."

    def _check_shown(self) -> None:
        shot = self._in_flight
        if shot is not None and shot.expectation.tag_id == self._view.standing():
            raise NotNow("A picture is being taken here: decide when it is shown.")

    def _run(self) -> None:
        while (task := self._inbox.get()) is not None:
            try:
                task()
                if self._inbox.empty():
                    self._publish()
            except ReadingDamaged as error:
                self._leave_out(error)
            except FieldcamError as error:
                self._tell(events.StorageTrouble(error))

    def _leave_out(self, damage: ReadingDamaged) -> None:
        """A reading that turned out to be damaged, and have its picture read again."""
        self._tell(events.Damaged(f"{damage.message} Its picture is read again."))
        self._store.undo(damage.reading, why=WHY)
        self._readings.take_up(again=False)
        self.do(c.Refresh())

    def _publish(self) -> None:
        state = self._view.state()
        if state.shown is not None and state.shown.id in self._readings.under_way:
            # It failed before, and is being read once more.
            state = replace(state, shown=replace(state.shown, failure=""))
        self._aiming.due = state.tag_id
        camera = CameraState.EXPOSING if self._in_flight else self._camera
        status = self._analysis.status
        told = replace(
            state,
            camera=camera,
            camera_trouble=self._camera_trouble,
            camera_notes=self._camera_notes,
            analysis=status,
            uncalibrated=self._uncalibrated,
        )
        self._tell(events.Changed(told))

    @property
    def _uncalibrated(self) -> str:
        return "" if self._calibration is None else self._calibration.problem

    def _check_shutter(self) -> None:
        """Presses do not queue: whoever presses again may stand at the next cluster by then."""
        if self._in_flight is not None:
            raise NotNow("A picture is being taken: wait until it is saved.")
        if (day := self._another_day()) is not None:
            raise NewDay(day)

    def _sent(self, shot: Shot) -> str:
        self._in_flight, self._shutter.moved_to = shot, None
        self._shutter.fire(shot)
        return f"Taking {shot.named}."

    def _heard(self, shot: Shot | None, event: events.ShutterEvent) -> None:
        """In the camera's thread."""
        self._inbox.put(partial(self._took, shot, event))

    def _took(self, shot: Shot | None, event: events.ShutterEvent) -> None:
        if shot is self._in_flight:
            self._in_flight = None
        if isinstance(event, events.CameraTrouble) and event.lost:
            self._camera, self._camera_trouble = CameraState.LOST, str(event.error)
        elif isinstance(event, events.CameraReady | events.Saved):
            self._camera = CameraState.READY
        if isinstance(event, events.CameraReady):
            self._camera_notes = tuple(n for n in event.notes if n != self._uncalibrated)
        self._tell(event)
        if shot is not None and isinstance(event, events.Saved):
            self._readings.submit(event.capture, shot.expectation, urgent=True)
