"""A simulated row walked without a screen: a loop gives the commands that keys give in the app."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import AnalysisState
from fieldcam.app.rendered import BESIDE_RENDERING, OPERATOR, RENDER_DEADLINE_S, kept_row
from fieldcam.app.rig import Rig
from fieldcam.camera.simulated import SimulatedCamera, SimulatedVisit, row_of_block
from fieldcam.session.calibrating import keep_known
from fieldcam.session.commands import AcceptPicture, GoTo, RestartAnalysis, Shoot
from fieldcam.session.events import (
    AnalysisTrouble,
    CameraTrouble,
    Changed,
    Damaged,
    Doubted,
    LiveEvent,
    Saved,
    StorageTrouble,
    VerdictReady,
)
from fieldcam.session.live import LiveWalk
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.readings import stored_reading
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store
from fieldcam.values import ClusterReading, Status

if TYPE_CHECKING:
    from fieldcam.simulator import BlockPlan
    from fieldcam.simulator.truth import Truth

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True, eq=False)
class RowPicture:
    """One picture of the row, with what it truly shows."""

    day: int
    truth: Truth

    @property
    def words(self) -> str:
        return f"Tag {self.truth.tag_id}, day {self.day}"


@dataclass(frozen=True, slots=True, eq=False)
class RowReading:
    """What was read of a picture."""

    picture: RowPicture
    reading: ClusterReading
    duration_ms: float
    """From saved to reading."""


def walk_row(
    store: Store, block: BlockPlan, days: Sequence[int], networks: Path, say: Say
) -> Iterator[RowReading]:
    """One picture of each cluster on each day, as they are read; the rest is said.

    `networks` is where a user's own may lie. Raises what the camera and the store do, since
    nothing more can be saved then.
    """
    store.sign_in(OPERATOR)
    row = row_of_block(block)
    kept = kept_row(store, block.seed, row, "without a screen")
    calibration, setup = keep_known(store, row.calibration), Setup(row.calibration, data=networks)
    unread: dict[EntryId, RowPicture] = {}

    def rig(camera: SimulatedCamera) -> Rig:
        return Rig(lambda: camera, setup, BESIDE_RENDERING, RENDER_DEADLINE_S, calibration)

    for day in days:
        visit = store.visit(kept, row.first_day + timedelta(days=day))
        pictures = [SimulatedVisit(index, day) for index in range(len(row.tag_ids))]
        heard: SimpleQueue[LiveEvent] = SimpleQueue()
        with (
            SimulatedCamera(block, pictures) as camera,
            closing(rig(camera).walk(store, visit, heard.put)) as walk,
        ):
            walked = _Day(store, day, camera, walk, heard, unread, say)
            for tag_id in row.tag_ids:
                yield from walked.take(tag_id)
            if day == days[-1]:
                yield from walked.read_again()


@dataclass(slots=True)
class _Day:
    """A walk of one day, and who walks it."""

    store: Store
    day: int
    camera: SimulatedCamera
    walk: LiveWalk
    heard: SimpleQueue[LiveEvent]
    unread: dict[EntryId, RowPicture]
    """Pictures of this day and of those before."""
    say: Say
    off: bool = False
    """The analysis was given up."""
    _awaited: set[EntryId] = field(default_factory=set)
    """Pictures of which something is to be heard before it goes on."""

    def take(self, tag_id: int) -> Iterator[RowReading]:
        """One picture of this cluster, whatever was taken of it before."""
        self.walk.do(GoTo(tag_id))
        self.walk.do(Shoot())
        saved = False
        while not saved or self._awaited:
            event = self.heard.get()
            saved = saved or isinstance(event, Saved)
            yield from self._hear(event, " It is tried again at the end.")

    def read_again(self) -> Iterator[RowReading]:
        """A machine that was busy may have time now; what fails once more stays unread."""
        if self.off or not self.unread:
            return
        self._awaited = set(self.unread)
        self.walk.do(RestartAnalysis())
        while self._awaited:
            yield from self._hear(self.heard.get())

    def _hear(self, event: LiveEvent, then: str = "") -> Iterator[RowReading]:
        match event:
            case CameraTrouble(error) | StorageTrouble(error):
                raise error
            case Doubted():
                event.insist()
            case Damaged(sentence):
                self.say(sentence)
            case Saved():
                picture = RowPicture(self.day, self.camera.last.capture.truth)
                self.unread[event.capture.key] = picture
                self._awaited.add(event.capture.key)
            case VerdictReady():
                yield from self._read(event)
            case AnalysisTrouble(capture, _, error) if capture.key in self.unread:
                self._awaited.discard(capture.key)
                self.say(f"{self.unread[capture.key].words}: {error}{then}")
            case Changed(state) if state.analysis.state is AnalysisState.STOPPED:
                self._stop_waiting(state.analysis.last_error)

    def _read(self, event: VerdictReady) -> Iterator[RowReading]:
        """A picture that asks nothing is accepted."""
        key = event.capture.key
        self._awaited.discard(key)
        picture = self.unread.pop(key, None)
        if picture is None:
            return  # of an earlier walk, which was cut off
        if event.verdict.status is Status.ACCEPT:
            self.walk.do(AcceptPicture(key))
        found = row_of(self.store.database, "capture_now", key)["reading"]
        reading = stored_reading(self.store.database, found)
        yield RowReading(picture, reading, event.duration_ms)

    def _stop_waiting(self, sentence: str) -> None:
        for key in self._awaited:
            self.off = True
            self.say(f"{self.unread[key].words}: {sentence}")
        self._awaited.clear()
