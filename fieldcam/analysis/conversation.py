"""Requests and replies with one analysis process, never longer than a deadline."""

from __future__ import annotations

import os
import select
import threading
from time import monotonic

from fieldcam.analysis.process import KEPT, AnalysisProcess
from fieldcam.analysis.replies import Reply
from fieldcam.analysis.requests import Request
from fieldcam.errors import AnalysisFailed, AnalysisOff, AnalysisTimeout


class Bell:
    """Wakes the thread that waits for a process: there is work, or it is time to close."""

    def __init__(self) -> None:
        self._descriptor = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.closing = threading.Event()

    def fileno(self) -> int:
        return self._descriptor

    def ring(self) -> None:
        os.eventfd_write(self._descriptor, 1)

    def quiet(self) -> None:
        """Only for who saw that it rings."""
        os.eventfd_read(self._descriptor)

    def close(self) -> None:
        """Ring once more, for the end."""
        self.closing.set()
        self.ring()

    def dispose(self) -> None:
        """Only when nobody is left to hear it."""
        os.close(self._descriptor)


class Conversation:
    """Raises AnalysisFailed when the process is lost and AnalysisOff when it is to end."""

    def __init__(self, process: AnalysisProcess, bell: Bell) -> None:
        self._process = process
        self._bell = bell
        self._poll = select.poll()
        for source in (process, bell):
            self._poll.register(source, select.POLLIN)

    def ask(self, request: Request, deadline_s: float) -> Reply:
        """The reply; a process that gives none in time must be killed."""
        until_s = monotonic() + deadline_s
        self._process.send(request)
        while (left_s := until_s - monotonic()) > 0:
            if self._hears(left_s) and (reply := self._process.receive()) is not None:
                return reply
        raise AnalysisTimeout(
            f"The analysis took longer than {deadline_s:g} s and was ended.", KEPT
        )

    def check(self) -> None:
        """Find out now what would else be blamed on the next pair."""
        if self._hears(0):
            self._unasked()

    def rest(self, longest_s: float) -> bool:
        """Wait for the bell; False when it did not ring."""
        until_s = monotonic() + longest_s
        self._rang = False
        while not self._rang and (left_s := until_s - monotonic()) > 0:
            if self._hears(left_s):
                self._unasked()
        return self._rang

    def _hears(self, longest_s: float) -> bool:
        """Whether the process has something to say; also returns when the bell rings."""
        ready = {descriptor for descriptor, _ in self._poll.poll(longest_s * 1000)}
        self._rang = self._bell.fileno() in ready
        if self._rang:
            self._bell.quiet()
        if self._bell.closing.is_set():
            raise AnalysisOff("The analysis was closed.", KEPT)
        return self._process.fileno() in ready

    def _unasked(self) -> None:
        try:
            self._process.receive()
        except AnalysisFailed as lost:
            if self._process.left_by_itself:
                raise AnalysisOff("The analysis left by itself.", KEPT) from lost
            raise
        raise AnalysisFailed("The analysis spoke without being asked.", KEPT)
