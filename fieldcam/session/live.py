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

from fieldcam.analysis.status import Status
from fieldcam.camera.port import DEADLINE_S, FlashStereoDevice
from fieldcam.errors import FieldcamError, ReadingDamaged
from fieldcam.growth.places import Place, Word
from fieldcam.session import events
from fieldcam.session.aim.aiming import Aiming
from fieldcam.session.aim.preview_file import PreviewFile, preview_folder
from fieldcam.session.book import WalkBook
from fieldcam.session.calibrating import CameraCalibration
from fieldcam.session.deciding.undoing import undo_fruit, undo_last, undo_match
from fieldcam.session.doubt import Doubtful, NewDay, NotNow
from fieldcam.session.fruit_book import FruitBook
from fieldcam.session.old_files import OldFiles
from fieldcam.session.reading import Analysis, Readings
from fieldcam.session.shutter import Shot, Shutter
from fieldcam.session.state import CameraState, Shown
from fieldcam.session.viewing import WalkView
from fieldcam.store.captures import SavedCapture
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.judgements import Answer
from fieldcam.store.seals import WHY
from fieldcam.store.store import Store
from fieldcam.values import Expectation


def _no_question() -> None:
    """The visit's day is not the clock's to say."""


class LiveWalk:
    """One visit in an open store; runs from the moment it is made until `close`."""

    def __init__(
        self,
        store: Store,
        visit: EntryId,
        open_camera: Callable[[], FlashStereoDevice],
        start_analysis: Callable[[Callable[[Status], None]], Analysis],
        listener: events.Listener,
        deadline_s: float = DEADLINE_S,
        calibration: CameraCalibration | None = None,
        day_question: Callable[[], str | None] = _no_question,
    ) -> None:
        """`start_analysis` is given what wants to hear of the analysis's status.

        `calibration` goes with each picture; None where the analysis knows the camera.
        `day_question` says what to ask before a picture of another day than the visit's.
        """
        self._store, self._tell, self._day_question = store, listener, day_question
        self._view = WalkView(store, visit)
        self._book, self._fruit = WalkBook(self._view), FruitBook(self._view)
        self._inbox: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._camera = CameraState.OPENING
        self._in_flight: Shot | None = None
        """The picture that was asked for, until it is saved or missed."""
        self._camera_trouble = ""
        self._camera_notes: tuple[str, ...] = ()
        self._analysis = start_analysis(lambda status: self._inbox.put(_nothing))
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
            self.shoot,
            self._aiming,
            deadline_s,
            calibration,
        )

    def start_preview(self) -> None:
        """Tell what the camera sees, once or twice a second, until told to stop."""
        self._shutter.start_preview()

    def stop_preview(self) -> None:
        self._shutter.stop_preview()

    def shoot(self) -> None:
        """Take the picture that is due; the camera's own shutter does the same."""
        self._order(self._fire)

    def second_view(self) -> None:
        """Take another view of the same cluster, beside the last one."""
        self._order(self._second_view)

    def accept(self) -> None:
        self._decide(self._book.accept)

    def retake(self) -> None:
        self._decide(self._book.retake)

    def fallen(self) -> None:
        self._decide(partial(self._book.answer, Answer.FALLEN))

    def hidden(self) -> None:
        self._decide(partial(self._book.answer, Answer.HIDDEN))

    def accept_picture(self, capture: EntryId) -> None:
        """Of any visit, before whose cluster nobody may stand now."""
        self._write(partial(self._book.accept_picture, capture))

    def tell_missing(self, capture: EntryId, place: Place | None, answer: Answer) -> None:
        """Say of one fruitlet of an earlier picture why this one does not show it."""
        self._write(partial(self._book.tell_missing, capture, place, answer))

    def correct_tag(self, tag_id: int) -> None:
        """The picture shows this tag; it is read again with what is expected there."""
        self._order(partial(self._decided, partial(self._correct, tag_id)))

    def other_target(self) -> None:
        self._decide(self._book.other_target)

    def strike(self, fruitlet: int) -> None:
        self._decide(partial(self._book.strike, fruitlet))

    def king(self, capture: EntryId, fruitlet: int) -> None:
        self._write(partial(self._book.king, capture, fruitlet))

    def add_by_hand(self, capture: EntryId, diameter_mm: float) -> None:
        self._write(partial(self._book.add_by_hand, capture, diameter_mm))

    def name_fruit(
        self, capture: EntryId, fruitlet: int, fruit: str, diameter_mm: float | None
    ) -> None:
        """Name a fruitlet of any picture, perhaps with its size by caliper."""
        self._write(partial(self._fruit.name_fruit, capture, fruitlet, fruit, diameter_mm))

    def match(self, word: Word) -> None:
        """Say which fruitlet of one picture is which of another."""
        self._write(partial(self._fruit.match, word))

    def note(self, text: str) -> None:
        self._write(partial(self._book.note, text))

    def skip(self) -> None:
        self._write(self._book.skip)

    def go_to(self, tag_id: int) -> None:
        self._write(partial(self._book.go_to, tag_id))

    def step(self, by: int) -> None:
        self._write(partial(self._book.step, by))

    def next_tree(self) -> None:
        self._write(self._book.next_tree)

    def undo(self) -> None:
        self._write(self._undo)

    def undo_match(self, tag_id: int) -> None:
        """Take back the last match that was said of this cluster."""
        self._write(partial(undo_match, self._store, self._view.visit, tag_id))

    def undo_fruit(self, tag_id: int) -> None:
        """Take back the last name, size or king of this cluster's fruitlets."""
        self._write(partial(undo_fruit, self._store, self._view.visit, tag_id))

    def refresh(self) -> None:
        """Tell the state anew, since others wrote to the store."""
        self._inbox.put(_nothing)

    def restart_analysis(self) -> None:
        """Start it again after it was given up, with the pictures that wait."""
        self._order(self._restart)

    def close(self) -> None:
        """Save what was asked for, then end; pictures without a reading wait in the store."""
        self._old_files.close()
        self._shutter.close()
        self._analysis.close()
        self._inbox.put(None)
        self._thread.join()

    def _write(self, command: Callable[..., str]) -> None:
        """The decision and what follows from it are durable together."""
        self._order(partial(self._store.together, self._moving, command))

    def _decide(self, command: Callable[..., str]) -> None:
        """About the picture that is shown."""
        self._write(partial(self._decided, command))

    def _decided(self, command: Callable[..., str], **insist: bool) -> str:
        shot = self._in_flight
        if shot is not None and shot.expectation.tag_id == self._view.standing():
            raise NotNow("A picture is being taken here: decide when it is shown.")
        return command(**insist)

    def _moving(self, command: Callable[..., str], **insist: bool) -> str:
        """Whoever has gone on wants no picture that has not begun, nor to be taken back by one."""
        before = self._view.place()
        done = command(**insist)
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
        return f"{done} The picture of {_named(shot)} that waited was not taken."

    def _order(self, command: Callable[..., str]) -> None:
        self._inbox.put(partial(self._obey, command))

    def _obey(self, command: Callable[..., str]) -> None:
        try:
            done = command()
        except Doubtful as doubt:
            insist = partial(self._order, partial(command, insist=True))
            self._tell(events.Doubted(doubt.message, insist))
        except NotNow as refusal:
            self._tell(events.Refused(refusal.message))
        except NewDay as question:
            self._tell(events.DayDoubted(question.message))
        else:
            self._tell(events.Done(done))

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
        self._inbox.put(_nothing)

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

    def _fire(self, insist: bool = False) -> str:
        self._check_shutter()
        return self._sent(self._book.shot(insist))

    def _second_view(self) -> str:
        self._check_shutter()
        return self._sent(self._book.second_view())

    def _check_shutter(self) -> None:
        """Presses do not queue: whoever presses again may stand at the next cluster by then."""
        if self._in_flight is not None:
            raise NotNow("A picture is being taken: wait until it is saved.")
        if (question := self._day_question()) is not None:
            raise NewDay(question)

    def _sent(self, shot: Shot) -> str:
        self._in_flight, self._shutter.moved_to = shot, None
        self._shutter.fire(shot)
        return f"Taking {_named(shot)}."

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

    def _correct(self, tag_id: int, insist: bool = False) -> str:
        correct = partial(self._book.correct_tag, tag_id, insist)
        done = self._store.together(self._moving, correct)
        shown = self._view.shown(tag_id, self._view.route())
        if shown is not None:
            saved = SavedCapture(shown.id, shown.left, shown.right, self._store.database_path)
            self._readings.submit(saved, self._expected_beside(shown, tag_id), urgent=True)
        return done

    def _expected_beside(self, shown: Shown, tag_id: int) -> Expectation:
        """What this cluster had, beside the tag that the picture shows: it is the right one."""
        expected, summary = self._view.expectation(tag_id), shown.record.reading
        if summary is None or summary.tag_read is None:
            return expected
        return replace(expected, tag_id=summary.tag_read)

    def _undo(self) -> str:
        sentence, tag_id = undo_last(self._store, self._view.visit)
        self._book.stand_where_undone(tag_id)
        return sentence

    def _restart(self) -> str:
        self._analysis.restart()
        self._readings.take_up(again=True)
        return "The analysis was started again."


def _named(shot: Shot) -> str:
    tag_id = shot.expectation.tag_id
    return "a new tag" if tag_id is None else f"tag {tag_id}"


def _nothing() -> None:
    """Only the state is published."""
