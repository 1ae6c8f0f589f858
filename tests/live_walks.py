"""A live walk of a made-up block, with a camera and an analysis that do as told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from queue import Queue
from threading import Lock
from typing import Self, TypeVar

import numpy as np
from made_readings import TAG, encoded, made_fruitlet, made_reading
from stored_walks import MadeWalk, raw_pair, small_store

from fieldcam.analysis.status import AnalysisState, AnalysisStatus
from fieldcam.camera.port import FlashStereoDevice
from fieldcam.camera.preview import Preview
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import CameraUnplugged
from fieldcam.session.calibrating import OwnCalibration
from fieldcam.session.commands import Command, Shoot
from fieldcam.session.events import Changed, LiveEvent, Saved, VerdictReady
from fieldcam.session.live import LiveWalk
from fieldcam.session.set_up.today import AnotherDay
from fieldcam.session.state import WalkState
from fieldcam.store.captures import SavedCapture
from fieldcam.store.rows.row import EntryId
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Expectation,
    RawPair,
    Reason,
    ReasonCode,
    TagPose,
    Verdict,
)
from fieldcam.values import Status as VerdictStatus

PATIENCE_S = 10.0
_Event = TypeVar("_Event", bound=LiveEvent)


class ToldCamera:
    """Gives another picture each time, until it is pulled out."""

    serials = ("L", "R")
    calibration: Calibration | None = None
    notes: tuple[str, ...] = ()

    def __init__(self) -> None:
        self._taking = Lock()
        self.plugged = True
        self.opened = self.closed = self.taken = self.looks = 0
        self.sight: Preview | None = Preview(np.full((6, 8), 9, np.uint8), 3, flash_ready=True)

    def open(self) -> FlashStereoDevice:
        if not self.plugged:
            raise CameraUnplugged("No camera answers.", "Plug it in.")
        self.opened += 1
        return self

    def capture(self, deadline_s: float) -> RawPair:
        if not self.plugged:
            raise CameraUnplugged("No camera answers.", "Plug it in.")
        with self._taking:
            self.taken += 1
        return raw_pair(self.taken + 100)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Takes no picture, and is not given back, meanwhile."""
        with self._taking:
            yield

    def preview(self, deadline_s: float) -> Preview | None:
        if not self.plugged:
            raise CameraUnplugged("No camera answers.", "Plug it in.")
        self.looks += 1
        return self.sight

    def attend(self) -> None:
        if not self.plugged:
            raise CameraUnplugged("No camera answers.", "Plug it in.")

    def watch_shutter(self, pressed: Callable[[], None]) -> None:
        if not self.plugged:
            raise CameraUnplugged("No camera answers.", "Plug it in.")
        self.press = pressed

    def close(self) -> None:
        with self._taking:
            self.closed += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class ToldAnalysis:
    """Gives each picture the next outcome at once; keeps it waiting where there is none."""

    def __init__(self) -> None:
        self.status = AnalysisStatus(AnalysisState.READY)
        self.outcomes: list[ClusterReading | Exception] = []
        self.asked: list[tuple[SavedCapture, Expectation]] = []
        self.waiting: list[Future[EncodedReading]] = []
        self.sights: list[tuple[TagPose, ...] | Exception] = []
        """Of the previews; the last one stays, without any a preview waits."""
        self.looked: list[Path] = []
        self.looked_with: list[Path | None] = []
        """The calibration of each preview."""
        self.glances: list[Future[tuple[TagPose, ...]]] = []
        self.closed = False

    def submit(
        self,
        saved: SavedCapture,
        expectation: Expectation,
        *,
        urgent: bool = False,
        again: bool = False,
    ) -> Future[EncodedReading]:
        future: Future[EncodedReading] = Future()
        self.asked.append((saved, expectation))
        if not self.outcomes:
            self.waiting.append(future)
        elif isinstance(outcome := self.outcomes.pop(0), Exception):
            future.set_exception(outcome)
        else:
            future.set_result(encoded(outcome))
        return future

    def look(
        self, image: Path, shrunk: int, calibration: Path | None
    ) -> Future[tuple[TagPose, ...]]:
        future: Future[tuple[TagPose, ...]] = Future()
        self.looked.append(image)
        self.looked_with.append(calibration)
        self.glances.append(future)
        if self.sights:
            sight = self.sights[0] if len(self.sights) == 1 else self.sights.pop(0)
            if isinstance(sight, Exception):
                future.set_exception(sight)
            else:
                future.set_result(sight)
        return future

    def restart(self) -> None:
        self.status = AnalysisStatus(AnalysisState.READY)

    def close(self) -> None:
        self.closed = True


class Heard:
    """All events, in their order."""

    def __init__(self) -> None:
        self._queue: Queue[LiveEvent] = Queue()
        self.events: list[LiveEvent] = []

    def __call__(self, event: LiveEvent) -> None:
        self._queue.put(event)

    def next(self, kind: type[_Event]) -> _Event:
        """The next event of this kind; those before it are kept in `events`."""
        while True:
            event = self._queue.get(timeout=PATIENCE_S)
            self.events.append(event)
            if isinstance(event, kind):
                return event

    def until(self, right: Callable[[WalkState], bool]) -> WalkState:
        """The next state that is right."""
        while not right(state := self.next(Changed).state):
            pass
        return state


class Walked:
    """A live walk with all that it stands on."""

    def __init__(self, made: MadeWalk, visit: EntryId) -> None:
        self.made, self.store, self.visit = made, made.store, visit
        self.camera, self.analysis, self.heard = ToldCamera(), ToldAnalysis(), Heard()

    def start(
        self,
        calibration: OwnCalibration | None = None,
        another_day: Callable[[], AnotherDay | None] = lambda: None,
    ) -> WalkState:
        self.live = LiveWalk(
            self.store,
            self.visit,
            self.camera.open,
            lambda changed: self.analysis,
            self.heard,
            calibration=calibration,
            another_day=another_day,
        )
        return self.heard.next(Changed).state

    def after(
        self, command: Command | Callable[[], None], kind: type[_Event]
    ) -> tuple[_Event, WalkState]:
        """The first event of this kind that follows a command, and the state after it."""
        if callable(command):
            command()
        else:
            self.live.do(command)
        event = self.heard.next(kind)
        return event, self.heard.next(Changed).state

    def shoot(self, outcome: ClusterReading | Exception | None = None) -> WalkState:
        """Take a picture; the state once its outcome is there."""
        if outcome is not None:
            self.analysis.outcomes.append(outcome)
        kind = VerdictReady if isinstance(outcome, ClusterReading) else Saved
        return self.after(Shoot(), kind)[1]


def read(
    tag_id: int,
    fruitlets: int = 5,
    status: VerdictStatus = VerdictStatus.ACCEPT,
    code: ReasonCode | None = None,
) -> ClusterReading:
    """A reading of a target and of a neighbouring cluster of three."""
    target = [made_fruitlet(n, (100.0 + 30 * n, 100.0), 9.0 + n) for n in range(fruitlets)]
    others = [
        made_fruitlet(fruitlets + n, (300.0, 100.0), None, in_target=False, cluster=1)
        for n in range(3)
    ]
    reasons = () if code is None else (Reason(code, f"It is {code}."),)
    tag = replace(TAG, id=tag_id)
    return made_reading([*target, *others], verdict=Verdict(status, reasons), tag=tag)


@contextmanager
def walked(path: Path, days_later: int = 0) -> Iterator[Walked]:
    """A walk of four clusters in two trees; not started."""
    with small_store(path) as store:
        made = MadeWalk(store)
        found = Walked(made, made.visit(days_later))
        try:
            yield found
        finally:
            if hasattr(found, "live"):
                found.live.close()
