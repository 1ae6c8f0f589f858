"""The app's hold on one analysis process: start it, ask it, end it."""

from __future__ import annotations

import os
import select
import signal
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from subprocess import PIPE, Popen, TimeoutExpired
from time import monotonic
from typing import IO, Self

from fieldcam.analysis.messages import (
    Frames,
    MessageInvalid,
    Reply,
    Request,
    decode_reply,
    encode_request,
)
from fieldcam.errors import AnalysisFailed, AnalysisOff, AnalysisTimeout

KEPT = "The picture is kept."
NO_ANSWER = "The analysis gave an answer that is none."
_PIECE_BYTES = 1 << 20
_LOG_BYTES = 1 << 20
"""A longer log is begun anew."""
_END_S = 0.9
"""A process that the kernel holds longer than this after SIGKILL is left to it."""


class Wakeup:
    """For the thread that waits for a process: there is work, or it is time to close."""

    def __init__(self) -> None:
        self._descriptor = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.closing = threading.Event()

    def fileno(self) -> int:
        return self._descriptor

    def wake(self) -> None:
        os.eventfd_write(self._descriptor, 1)

    def clear(self) -> None:
        """Only for who was woken by it."""
        os.eventfd_read(self._descriptor)

    def close(self) -> None:
        """Wake once more, for the end."""
        self.closing.set()
        self.wake()

    def dispose(self) -> None:
        """Only when nobody is left to hear it."""
        os.close(self._descriptor)


class AnalysisProcess:
    """One child.

    Every method raises AnalysisFailed once it is lost, and those that wait AnalysisOff
    when it is to end.
    """

    def __init__(self, command: Sequence[str], log: Path | None, wakeup: Wakeup) -> None:
        """The id of this process is added to the command."""
        try:
            with _open_log(log) as output:
                self._process = Popen(
                    [*command, str(os.getpid())], stdin=PIPE, stdout=PIPE, stderr=output, bufsize=0
                )
        except OSError as error:
            raise AnalysisFailed(
                f"The analysis cannot be started: {error.strerror}.", KEPT
            ) from error
        self._requests, self._replies = _pipe(self._process.stdin), _pipe(self._process.stdout)
        self._frames = Frames()
        self._wakeup = wakeup
        self._poll = select.poll()
        for source in (self._replies, wakeup):
            self._poll.register(source, select.POLLIN)

    def ask(self, request: Request, deadline_s: float) -> Reply:
        """The reply; a process that gives none in time must be killed."""
        until_s = monotonic() + deadline_s
        self._send(request)
        while (left_s := until_s - monotonic()) > 0:
            if self._hears(left_s):
                for reply in self._receive():
                    return reply
        raise AnalysisTimeout(
            f"The analysis took longer than {deadline_s:g} s and was ended.", KEPT
        )

    def check(self) -> None:
        """Find out now what would else be blamed on the next pair."""
        if self._hears(0):
            self._unasked()

    def rest(self, longest_s: float) -> bool:
        """Wait to be woken; False when nobody did."""
        until_s = monotonic() + longest_s
        self._woken = False
        while not self._woken and (left_s := until_s - monotonic()) > 0:
            if self._hears(left_s):
                self._unasked()
        return self._woken

    def kill(self) -> None:
        self._process.kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Kill it, since it holds nothing that could be lost."""
        self._process.kill()
        with suppress(TimeoutExpired):
            self._process.wait(_END_S)
        for pipe in (self._requests, self._replies):
            pipe.close()

    def _send(self, request: Request) -> None:
        try:
            self._requests.write(encode_request(request))
        except OSError as error:
            raise self._lost() from error

    def _receive(self) -> list[Reply]:
        """The one reply that is complete now; none where more of it has to come."""
        piece = os.read(self._replies.fileno(), _PIECE_BYTES)
        if not piece:
            raise self._lost()
        try:
            replies = [decode_reply(document) for document in self._frames.feed(piece)]
        except MessageInvalid as error:
            raise AnalysisFailed(NO_ANSWER, KEPT) from error
        if len(replies) > 1:
            raise AnalysisFailed("The analysis gave more answers than one.", KEPT)
        return replies

    def _hears(self, longest_s: float) -> bool:
        """Whether the process has something to say; also returns when woken."""
        ready = {descriptor for descriptor, _ in self._poll.poll(longest_s * 1000)}
        self._woken = self._wakeup.fileno() in ready
        if self._woken:
            self._wakeup.clear()
        if self._wakeup.closing.is_set():
            raise AnalysisOff("The analysis was closed.", KEPT)
        return self._replies.fileno() in ready

    def _unasked(self) -> None:
        try:
            self._receive()
        except AnalysisFailed as lost:
            if self._process.returncode == 0:
                raise AnalysisOff("The analysis left by itself.", KEPT) from lost
            raise
        raise AnalysisFailed("The analysis spoke without being asked.", KEPT)

    def _lost(self) -> AnalysisFailed:
        try:
            how = _ending(self._process.wait(_END_S))
        except TimeoutExpired:
            how = "it closed its pipe"
        return AnalysisFailed(f"The analysis ended in the middle ({how}).", KEPT)


def _pipe(stream: IO[bytes] | None) -> IO[bytes]:
    assert stream is not None  # both ends are pipes
    return stream


def _ending(code: int) -> str:
    return f"exit status {code}" if code >= 0 else str(signal.strsignal(-code)).lower()


def _open_log(path: Path | None) -> IO[bytes]:
    """Where the process's own output goes; a log that cannot be written stops nothing."""
    if path is not None:
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            too_long = path.exists() and path.stat().st_size > _LOG_BYTES
            return path.open("wb" if too_long else "ab")
    return Path(os.devnull).open("wb")
