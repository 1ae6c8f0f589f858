"""What the supervisor's thread shares with everybody else: what waits, and the status."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from fieldcam.analysis.messages import Analyse, FindTags, Tags
from fieldcam.analysis.process import KEPT, Wakeup
from fieldcam.analysis.status import AnalysisState, AnalysisStatus
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import AnalysisFailed, AnalysisOff, AnalysisTimeout, FieldcamError

Listener = Callable[[AnalysisStatus], None]
Asked = TypeVar("Asked", Analyse, FindTags)
Outcome = TypeVar("Outcome", EncodedReading, Tags)


@dataclass(slots=True, eq=False)
class Job(Generic[Asked, Outcome]):
    """A request and the promise of its outcome."""

    request: Asked
    future: Future[Outcome] = field(default_factory=Future)

    def claim(self) -> bool:
        """Whether it is still wanted; from then on it cannot be cancelled."""
        return self.future.running() or self.future.set_running_or_notify_cancel()

    def settle(self, outcome: Outcome | FieldcamError) -> None:
        if not self.claim():
            return
        if isinstance(outcome, FieldcamError):
            self.future.set_exception(outcome)
        else:
            self.future.set_result(outcome)


PairJob = Job[Analyse, EncodedReading]
PreviewJob = Job[FindTags, Tags]


class WorkQueue:
    """Saved pairs in their order, and one preview, since a newer one takes its place.

    Every method may be called from any thread; futures and the listener run unlocked.
    """

    def __init__(self, wakeup: Wakeup, listener: Listener, tries: int) -> None:
        self._wakeup, self._listener, self._tries = wakeup, listener, tries
        self._lock = threading.Lock()
        self._waiting: deque[PairJob] = deque()
        self._in_hand: PairJob | None = None
        self._preview: PreviewJob | None = None
        self._crashes: Counter[str] = Counter()
        self._status = self._told = AnalysisStatus()

    @property
    def status(self) -> AnalysisStatus:
        with self._lock:
            return self._status

    def submit(self, pair: PairJob, urgent: bool, again: bool) -> None:
        """Let it wait, or fail it at once."""
        with self._lock:
            if again:
                del self._crashes[_key(pair)]
            refusal = self._refusal(pair)
            if refusal is None:
                self._line_up(pair, urgent)
                self._wakeup.wake()
        if refusal is not None:
            pair.settle(refusal)

    def look(self, preview: PreviewJob) -> None:
        """Let it wait in place of an older one, or fail it at once."""
        with self._lock:
            off, overtaken = self._off(), self._preview
            if off is None:
                self._preview = preview
                self._wakeup.wake()
        if off is not None:
            preview.settle(off)
        elif overtaken is not None:
            overtaken.future.cancel()

    def take(self) -> PairJob | None:
        """The next pair that is still wanted, now in hand."""
        with self._lock:
            while self._waiting and self._in_hand is None:
                pair = self._waiting.popleft()
                self._in_hand = pair if pair.claim() else None
            self._count()
            return self._in_hand

    def take_preview(self) -> PreviewJob | None:
        """The one that waits."""
        with self._lock:
            taken, self._preview = self._preview, None
        return taken

    def answer(self, outcome: EncodedReading | FieldcamError) -> None:
        """The outcome of the pair in hand."""
        with self._lock:
            pair, self._in_hand = self._in_hand, None
            self._count()
        if pair is not None:
            pair.settle(outcome)

    def blame(self, error: AnalysisFailed) -> None:
        """The process was lost on the pair in hand, which gets one more chance, or none."""
        with self._lock:
            pair = self._in_hand
            if pair is None:
                return
            self._crashes[_key(pair)] += 1
            hopeless = self._crashes[_key(pair)] >= self._tries
            if not hopeless and not isinstance(error, AnalysisTimeout):
                self._in_hand = None
                self._line_up(pair, first=True)
                return
        self.answer(error)

    def enter(self, state: AnalysisState) -> None:
        """Go into a state and tell the listener."""
        with self._lock:
            restarts = self._status.restarts + (state is AnalysisState.RESTARTING)
            self._status = replace(self._status, state=state, restarts=restarts)
        self._tell()

    def note(self, sentence: str) -> None:
        """Remember what went wrong; told with the next change of state."""
        with self._lock:
            self._status = replace(self._status, last_error=sentence)

    def open(self) -> None:
        """Take pairs and previews again, with a clean slate."""
        with self._lock:
            self._crashes.clear()
        self.enter(AnalysisState.STARTING)

    def shut(self, reason: AnalysisOff) -> None:
        """Take no more; those not answered fail."""
        with self._lock:
            pairs = [*filter(None, [self._in_hand]), *self._waiting]
            preview, self._preview = self._preview, None
            self._waiting.clear()
            self._in_hand = None
            self._count()
            self._status = replace(
                self._status, state=AnalysisState.STOPPED, last_error=reason.message
            )
        for pair in pairs:
            pair.settle(reason)
        if preview is not None:
            preview.settle(reason)
        self._tell()

    def _tell(self) -> None:
        with self._lock:
            news = self._status if self._status != self._told else None
            self._told = self._status
        if news is not None:
            self._listener(news)

    def _line_up(self, pair: PairJob, first: bool) -> None:
        (self._waiting.appendleft if first else self._waiting.append)(pair)
        self._count()

    def _count(self) -> None:
        pending = len(self._waiting) + (self._in_hand is not None)
        self._status = replace(self._status, pending=pending)

    def _refusal(self, pair: PairJob) -> AnalysisFailed | None:
        if self._crashes[_key(pair)] >= self._tries:
            again = AnalysisFailed("This pair ended the analysis before; it is not retried.", KEPT)
            return self._off() or again
        return self._off()

    def _off(self) -> AnalysisOff | None:
        if self._status.state is not AnalysisState.STOPPED:
            return None
        return AnalysisOff("The analysis is off.", f"{KEPT} Start the analysis again.")


def _key(pair: PairJob) -> str:
    return pair.request.saved.key
