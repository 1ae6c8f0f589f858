"""What the supervisor's thread shares with everybody else: pairs that wait, and the status."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace

from fieldcam.analysis.conversation import Bell
from fieldcam.analysis.process import KEPT
from fieldcam.analysis.status import State, Status
from fieldcam.errors import AnalysisFailed, AnalysisOff, AnalysisTimeout, FieldcamError
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ClusterReading, Expectation

Listener = Callable[[Status], None]


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """A saved pair and the promise of its reading."""

    saved: SavedCapture
    expectation: Expectation
    future: Future[ClusterReading] = field(default_factory=Future)

    def claim(self) -> bool:
        """Whether it is still wanted; from then on it cannot be cancelled."""
        return self.future.running() or self.future.set_running_or_notify_cancel()

    def fail(self, error: FieldcamError) -> None:
        if self.claim():
            self.future.set_exception(error)


class Desk:
    """Every method may be called from any thread; futures and the listener run unlocked."""

    def __init__(self, bell: Bell, listener: Listener, tries: int) -> None:
        self._bell, self._listener, self._tries = bell, listener, tries
        self._lock = threading.Lock()
        self._waiting: deque[Job] = deque()
        self._in_hand: Job | None = None
        self._crashes: Counter[str] = Counter()
        self._status = self._told = Status()

    @property
    def status(self) -> Status:
        with self._lock:
            return self._status

    def submit(self, job: Job, urgent: bool, again: bool) -> None:
        """Let it wait, or fail it at once."""
        with self._lock:
            if again:
                del self._crashes[job.saved.key]
            refusal = self._refusal(job)
            if refusal is None:
                self._line_up(job, urgent)
                self._bell.ring()
        if refusal is not None:
            job.fail(refusal)

    def take(self) -> Job | None:
        """The next pair that is still wanted, now in hand."""
        with self._lock:
            while self._waiting and self._in_hand is None:
                job = self._waiting.popleft()
                self._in_hand = job if job.claim() else None
            self._count()
            return self._in_hand

    def answer(self, outcome: ClusterReading | FieldcamError) -> None:
        """The outcome of the pair in hand."""
        with self._lock:
            job, self._in_hand = self._in_hand, None
            self._count()
        if job is None:
            return
        if isinstance(outcome, FieldcamError):
            job.future.set_exception(outcome)
        else:
            job.future.set_result(outcome)

    def blame(self, error: AnalysisFailed) -> None:
        """The process was lost on the pair in hand, which gets one more chance, or none."""
        with self._lock:
            job = self._in_hand
            if job is None:
                return
            self._crashes[job.saved.key] += 1
            hopeless = self._crashes[job.saved.key] >= self._tries
            if not hopeless and not isinstance(error, AnalysisTimeout):
                self._in_hand = None
                self._line_up(job, first=True)
                return
        self.answer(error)

    def enter(self, state: State) -> None:
        """Go into a state and tell the listener."""
        with self._lock:
            restarts = self._status.restarts + (state is State.RESTARTING)
            self._status = replace(self._status, state=state, restarts=restarts)
        self._tell()

    def note(self, sentence: str) -> None:
        """Remember what went wrong; told with the next change of state."""
        with self._lock:
            self._status = replace(self._status, last_error=sentence)

    def open(self) -> None:
        """Take pairs again, with a clean slate."""
        with self._lock:
            self._crashes.clear()
        self.enter(State.STARTING)

    def shut(self, reason: AnalysisOff) -> None:
        """Take no more pairs; those not answered fail."""
        with self._lock:
            jobs = [*filter(None, [self._in_hand]), *self._waiting]
            self._waiting.clear()
            self._in_hand = None
            self._count()
            self._status = replace(self._status, state=State.STOPPED, last_error=reason.message)
        for job in jobs:
            job.fail(reason)
        self._tell()

    def _tell(self) -> None:
        with self._lock:
            news = self._status if self._status != self._told else None
            self._told = self._status
        if news is not None:
            self._listener(news)

    def _line_up(self, job: Job, first: bool) -> None:
        (self._waiting.appendleft if first else self._waiting.append)(job)
        self._count()

    def _count(self) -> None:
        pending = len(self._waiting) + (self._in_hand is not None)
        self._status = replace(self._status, pending=pending)

    def _refusal(self, job: Job) -> AnalysisFailed | None:
        if self._status.state is State.STOPPED:
            return AnalysisOff("The analysis is off.", f"{KEPT} Start the analysis again.")
        if self._crashes[job.saved.key] >= self._tries:
            return AnalysisFailed("This pair ended the analysis before; it is not retried.", KEPT)
        return None
