"""Keeps one analysis process alive and gives it saved pairs, one after the other.

A thread does the talking; whoever submits a pair gets a future at once. The
process is that thread's own child, so the kernel ends it with the thread.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path
from time import monotonic
from typing import Self

from fieldcam.analysis.messages import Analyse, FindTags, Ping, Setup, Tags, WarmUp
from fieldcam.analysis.process import KEPT, NO_ANSWER, AnalysisProcess, Wakeup
from fieldcam.analysis.queue import Listener, PairJob, PreviewJob, WorkQueue
from fieldcam.analysis.status import AnalysisState, AnalysisStatus, Limits
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import AnalysisFailed, AnalysisOff, FieldcamError
from fieldcam.safe_path import PYTHON
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Expectation

CHILD = (*PYTHON, "-m", "fieldcam.analysis.child")
"""The process that runs vision; another command may stand in that speaks as it does."""
DEFAULTS = Limits()
DEFECT = AnalysisOff("The analysis is off, by a defect of fieldcam.", KEPT)


def _deaf(status: AnalysisStatus) -> None:
    """Nobody listens."""


class Supervisor:
    """Runs from the moment it is made until `close`."""

    def __init__(
        self,
        setup: Setup,
        log: Path | None = None,
        listener: Listener = _deaf,
        limits: Limits = DEFAULTS,
        child: Sequence[str] = CHILD,
    ) -> None:
        """`listener` hears of changes in the supervisor's thread and must not wait for others.

        `log` takes what the process prints.
        """
        self._setup, self._log, self._limits, self._child = setup, log, limits, child
        self._wakeup = Wakeup()
        self._queue = WorkQueue(self._wakeup, listener, limits.tries)
        self._lifecycle = threading.Lock()
        self._process: AnalysisProcess | None = None
        self._start()

    def submit(
        self,
        saved: SavedCapture,
        expectation: Expectation,
        *,
        urgent: bool = False,
        again: bool = False,
    ) -> Future[EncodedReading]:
        """The promise of a reading, at once.

        An urgent pair goes before those that wait. A pair that ended the process
        too often is refused, unless the operator asks for it `again`.
        """
        pair = PairJob(Analyse(saved, expectation))
        self._queue.submit(pair, urgent, again)
        return pair.future

    def look(self, image: Path, shrunk: int, calibration: Path | None = None) -> Future[Tags]:
        """The promise of a preview's tags in its own pixels; a newer preview cancels it."""
        preview = PreviewJob(FindTags(image, shrunk, calibration))
        self._queue.look(preview)
        return preview.future

    @property
    def status(self) -> AnalysisStatus:
        return self._queue.status

    def restart(self) -> None:
        """Start again after STOPPED, with a clean slate; at other times nothing happens."""
        with self._lifecycle:
            if self.status.state is AnalysisState.STOPPED and not self._wakeup.closing.is_set():
                self._queue.open()
                self._start()

    def close(self) -> None:
        """End for good; pairs that wait fail."""
        with self._lifecycle:
            if self._wakeup.closing.is_set():
                return
            self._wakeup.close()
        if self._thread is threading.current_thread():
            return
        self._thread.join(self._limits.close_s)
        if not self._thread.is_alive():
            self._wakeup.dispose()
        elif self._process is not None:
            self._process.kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self) -> None:
        # A daemon, so that an app which forgets to close can still end.
        self._thread = threading.Thread(target=self._run, name="analysis", daemon=True)
        self._thread.start()

    # From here on all runs in that thread, whose child the process is.

    def _run(self) -> None:
        window = RestartWindow(self._limits.restarts, self._limits.span_s)
        reason = DEFECT
        try:
            while (ending := self._live()) is None and window.allow():
                self._queue.enter(AnalysisState.RESTARTING)
            reason = ending or _given_up(self._limits)
        finally:
            self._queue.shut(reason)

    def _live(self) -> AnalysisOff | None:
        """Serve with one process as long as it lives; None when another one should follow."""
        try:
            with AnalysisProcess(self._child, self._log, self._wakeup) as process:
                self._process = process
                self._serve(process)
        except AnalysisOff as off:
            return off
        except AnalysisFailed as lost:
            self._queue.note(lost.message)
        return None

    def _serve(self, process: AnalysisProcess) -> None:
        deadline_s = self._limits.first_pair_s
        reply = process.ask(WarmUp(self._setup), deadline_s)
        if isinstance(reply, FieldcamError):
            self._queue.note(reply.message)
        while True:
            process.check()
            if (preview := self._queue.take_preview()) is not None:
                self._look(process, preview, deadline_s)
                continue  # what came meanwhile wakes it once more
            pair = self._queue.take()
            if pair is None:
                self._rest(process)
                continue
            self._read(process, pair, deadline_s)
            deadline_s = self._limits.pair_s

    def _rest(self, process: AnalysisProcess) -> None:
        self._queue.enter(AnalysisState.READY)
        if not process.rest(self._limits.ping_every_s):
            process.ask(Ping(), self._limits.pair_s)

    def _look(self, process: AnalysisProcess, preview: PreviewJob, deadline_s: float) -> None:
        """Before the pairs that wait, since it takes no time and the operator aims by it."""
        try:
            reply = process.ask(preview.request, deadline_s)
            if not isinstance(reply, tuple | FieldcamError):
                raise AnalysisFailed(NO_ANSWER, KEPT)
        except AnalysisFailed as lost:
            preview.settle(lost)
            raise
        preview.settle(reply)

    def _read(self, process: AnalysisProcess, pair: PairJob, deadline_s: float) -> None:
        self._queue.enter(AnalysisState.BUSY)
        try:
            reply = process.ask(pair.request, deadline_s)
            if not isinstance(reply, EncodedReading | FieldcamError):
                raise AnalysisFailed(NO_ANSWER, KEPT)
        except AnalysisOff:
            raise  # everything that waits will be told
        except AnalysisFailed as lost:
            self._queue.blame(lost)
            raise
        self._queue.answer(reply)


class RestartWindow:
    """At most `limit` restarts within any `span_s` seconds."""

    def __init__(self, limit: int, span_s: float, clock_s: Callable[[], float] = monotonic) -> None:
        self._span_s = span_s
        self._clock_s = clock_s
        self._limit = limit
        self._times_s: deque[float] = deque()

    def allow(self) -> bool:
        """Whether one more restart is allowed now; if so, it is counted."""
        now_s = self._clock_s()
        while self._times_s and now_s - self._times_s[0] >= self._span_s:
            self._times_s.popleft()
        if len(self._times_s) >= self._limit:
            return False
        self._times_s.append(now_s)
        return True


def _given_up(limits: Limits) -> AnalysisOff:
    return AnalysisOff(
        f"The analysis ended {limits.restarts + 1} times within {limits.span_s:g} s and is off.",
        "The pictures are kept. Start the analysis again, or analyse them in the evening.",
    )
