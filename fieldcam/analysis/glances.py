"""Previews that wait to be looked at: one, since a newer one takes its place."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from dataclasses import dataclass, field

from fieldcam.analysis.conversation import Bell
from fieldcam.analysis.requests import Look
from fieldcam.errors import AnalysisOff, FieldcamError
from fieldcam.values import TagPose

Tags = tuple[TagPose, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Glance:
    """A preview and the promise of its tags."""

    look: Look
    future: Future[Tags] = field(default_factory=Future)

    def answer(self, outcome: Tags | FieldcamError) -> None:
        if not self.future.running() and not self.future.set_running_or_notify_cancel():
            return
        if isinstance(outcome, FieldcamError):
            self.future.set_exception(outcome)
        else:
            self.future.set_result(outcome)


class Glances:
    """Every method may be called from any thread; futures run unlocked."""

    def __init__(self, bell: Bell) -> None:
        self._bell = bell
        self._lock = threading.Lock()
        self._waiting: Glance | None = None
        self._off: AnalysisOff | None = None

    def submit(self, look: Look) -> Future[Tags]:
        """Let it wait, or fail it at once."""
        glance = Glance(look)
        with self._lock:
            off, overtaken = self._off, self._waiting
            if off is None:
                self._waiting = glance
                self._bell.ring()
        if off is not None:
            glance.answer(off)
        elif overtaken is not None:
            overtaken.future.cancel()
        return glance.future

    def take(self) -> Glance | None:
        """The one that waits."""
        with self._lock:
            taken, self._waiting = self._waiting, None
        return taken

    def open(self) -> None:
        """Take previews again."""
        with self._lock:
            self._off = None

    def shut(self, reason: AnalysisOff) -> None:
        """Take no more of them."""
        with self._lock:
            self._off = reason
        if (left := self.take()) is not None:
            left.answer(reason)
