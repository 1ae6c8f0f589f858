"""Has saved pictures read, beside a walk or one after the other, and keeps what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Protocol

from fieldcam.analysis.status import AnalysisStatus
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import AnalysisFailed, AnalysisOff, AnalysisTimeout, FieldcamError
from fieldcam.session.deciding.learning import learned
from fieldcam.session.events import AnalysisTrouble, Listener, VerdictReady
from fieldcam.session.viewing import WalkView
from fieldcam.store.captures import SavedCapture
from fieldcam.store.queries.imports import failed_alike
from fieldcam.store.readings import reading_row
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import AnalysisFailure
from fieldcam.store.store import Store
from fieldcam.values import Expectation, TagPose

TRIES = 2
"""A picture whose analysis failed this often is not tried again by itself."""
Pardoned = tuple[type[AnalysisFailed], ...]


class Reader(Protocol):
    """What reads saved pictures."""

    def submit(
        self,
        saved: SavedCapture,
        expectation: Expectation,
        *,
        urgent: bool = False,
        again: bool = False,
    ) -> Future[EncodedReading]: ...


class Analysis(Reader, Protocol):
    """What a walk needs of it besides; `analysis.supervisor.Supervisor` is one."""

    def look(
        self, image: Path, shrunk: int, calibration: Path | None
    ) -> Future[tuple[TagPose, ...]]: ...

    @property
    def status(self) -> AnalysisStatus: ...

    def restart(self) -> None: ...

    def close(self) -> None: ...


def _never(saved: SavedCapture, reading: EncodedReading) -> bool:
    """The operator decides."""
    return False


@dataclass(frozen=True, slots=True)
class Keeping:
    """What is kept of a picture that the analysis had: on a walk, by an import, or later."""

    store: Store
    view: WalkView | None
    """Of the picture's block; None for a picture of no visit."""
    accepts: Callable[[SavedCapture, EncodedReading], bool] = _never
    """Whether a picture counts without the operator's word."""
    once: bool = False
    """A failure that is known is not kept again, for those who ask time and again."""

    def read(
        self,
        reader: Reader,
        saved: SavedCapture,
        expectation: Expectation,
        pardoned: Pardoned = (),
    ) -> VerdictReady | AnalysisTrouble:
        """Have a picture read, and wait for it; raises as `outcome` does."""
        started = perf_counter()
        done = reader.submit(saved, expectation)
        return self.outcome(saved, expectation, started, done, pardoned)

    def outcome(
        self,
        saved: SavedCapture,
        expectation: Expectation,
        started: float,
        done: Future[EncodedReading],
        pardoned: Pardoned = (),
    ) -> VerdictReady | AnalysisTrouble:
        """Keep what came of it.

        Raises AnalysisOff, since the picture has not failed but waits, and what is
        `pardoned`, to be tried once more; nothing is kept of these.
        """
        try:
            reading = done.result()
        except FieldcamError as error:
            if isinstance(error, (AnalysisOff, *pardoned)):
                raise
            self._fail(saved, error)
            return AnalysisTrouble(saved, expectation.tag_id, error)
        duration_ms = (perf_counter() - started) * 1000
        new = () if self.view is None else learned(self.view, saved.key, reading)
        decided = (Decision(saved.key, Action.ACCEPT),) if self.accepts(saved, reading) else ()
        # Together, so that no crash leaves a reading whose tag the route does not have, or
        # whose acceptance is lost.
        self.store.append(reading_row(saved.key, reading, duration_ms), *new, *decided)
        tag_id = new[0].tag_id if new else expectation.tag_id
        before, now = expectation.fruitlets, len(reading.form.target)
        more = 0 if before is None else max(0, now - before)
        return VerdictReady(saved, tag_id, reading.verdict, duration_ms, more)

    def _fail(self, saved: SavedCapture, error: FieldcamError) -> None:
        cause = type(error).__name__
        if not (self.once and failed_alike(self.store.database, saved.key, cause, error.message)):
            self.store.append(AnalysisFailure(saved.key, cause, error.message))


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
        # A busy machine may have been to blame for the first time-out.
        pardoned = () if saved.key in self._late else (AnalysisTimeout,)
        keeping = Keeping(self.view.store, self.view)
        try:
            event = keeping.outcome(saved, expectation, started, done, pardoned)
        except AnalysisOff:
            return  # that the analysis is off is in its status
        except AnalysisTimeout:
            self._late.add(saved.key)  # once more, after all that wait
            self._submit(saved, expectation, urgent=False, again=False)
            return
        self.tell(event)
