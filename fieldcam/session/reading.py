"""Has saved pictures read beside the walk, and keeps what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Protocol

from fieldcam.analysis.status import Status
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import AnalysisOff, AnalysisTimeout, FieldcamError
from fieldcam.session.deciding.learning import learned
from fieldcam.session.events import AnalysisTrouble, Listener, VerdictReady
from fieldcam.session.viewing import WalkView
from fieldcam.store.captures import SavedCapture
from fieldcam.store.readings import reading_row
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import AnalysisFailure
from fieldcam.values import Expectation, TagPose

TRIES = 2
"""A picture whose analysis failed this often is not tried again by itself."""


class Analysis(Protocol):
    """What reads saved pictures; `analysis.supervisor.Supervisor` is one."""

    def submit(
        self,
        saved: SavedCapture,
        expectation: Expectation,
        *,
        urgent: bool = False,
        again: bool = False,
    ) -> Future[EncodedReading]: ...

    def look(
        self, image: Path, shrunk: int, calibration: Path | None
    ) -> Future[tuple[TagPose, ...]]: ...

    @property
    def status(self) -> Status: ...

    def restart(self) -> None: ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class Readings:
    """Used in the walk's thread; `post` brings the outcomes back into it."""

    view: WalkView
    analysis: Analysis
    post: Callable[[Callable[[], None]], None]
    tell: Listener
    completed: Callable[[SavedCapture], SavedCapture | None] = lambda saved: saved
    """Gives a picture what else its reading needs; None: it waits for that."""
    under_way: set[EntryId] = field(default_factory=set)
    """Pictures that the analysis has, whatever came of them before."""
    _late: set[EntryId] = field(default_factory=set)
    """Pictures that were not read in time once."""

    def submit(
        self, saved: SavedCapture, expectation: Expectation, urgent: bool, again: bool = False
    ) -> None:
        """The newest picture is urgent: the operator stands before its cluster."""
        complete = self.completed(saved)
        if complete is not None:
            self._submit(complete, expectation, urgent, again)

    def _submit(
        self, saved: SavedCapture, expectation: Expectation, urgent: bool, again: bool
    ) -> None:
        started = perf_counter()
        self.under_way.add(saved.key)
        future = self.analysis.submit(saved, expectation, urgent=urgent, again=again)
        future.add_done_callback(
            lambda done: self.post(partial(self._keep, saved, expectation, started, done))
        )

    def read_as(self, tag_id: int) -> None:
        """Have the last picture of a cluster read, with what is expected there."""
        shown = self.view.shown(tag_id, self.view.route())
        if shown is None:
            return
        expected, summary = self.view.expectation(tag_id), shown.record.reading
        if summary is not None and summary.tag_read is not None:
            # The tag that the picture shows is the right one.
            expected = replace(expected, tag_id=summary.tag_read)
        saved = SavedCapture(shown.id, shown.left, shown.right, self.view.store.database_path)
        self.submit(saved, expected, urgent=True)

    def take_up(self, again: bool) -> None:
        """Have read what an earlier run of the app, or of the analysis, left unread."""
        for picture, expectation in self.view.unread_of_block():
            if picture.saved.key in self.under_way:
                continue
            if again or picture.failures < TRIES:
                self.submit(picture.saved, expectation, urgent=False, again=again)

    def _keep(
        self,
        saved: SavedCapture,
        expectation: Expectation,
        started: float,
        done: Future[EncodedReading],
    ) -> None:
        self.under_way.discard(saved.key)
        try:
            reading = done.result()
        except AnalysisOff:
            return  # it has not failed, it waits; that the analysis is off is in its status
        except FieldcamError as error:
            if isinstance(error, AnalysisTimeout) and saved.key not in self._late:
                # A busy machine may have been to blame, so once more after all that wait.
                self._late.add(saved.key)
                self._submit(saved, expectation, urgent=False, again=False)
                return
            failure = AnalysisFailure(saved.key, type(error).__name__, error.message)
            self.view.store.append(failure)
            self.tell(AnalysisTrouble(saved, expectation.tag_id, error))
            return
        duration_ms = (perf_counter() - started) * 1000
        # Together, so that no crash leaves a reading whose tag the route does not have.
        new = learned(self.view, saved.key, reading)
        self.view.store.append(reading_row(saved.key, reading, duration_ms), *new)
        tag_id = new[0].tag_id if new else expectation.tag_id
        before, now = expectation.fruitlets, len(reading.form.target)
        more = 0 if before is None else max(0, now - before)
        self.tell(VerdictReady(saved, tag_id, reading.verdict, duration_ms, more))
