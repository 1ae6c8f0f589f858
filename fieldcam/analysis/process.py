"""The app's hold on one analysis process: start it, talk to it, end it."""

from __future__ import annotations

import os
import signal
from contextlib import suppress
from pathlib import Path
from subprocess import PIPE, Popen, TimeoutExpired
from types import TracebackType
from typing import IO, Self

from fieldcam.analysis.frames import FrameInvalid, Frames, frame
from fieldcam.analysis.replies import Reply, decode_reply
from fieldcam.analysis.requests import Request, encode_request
from fieldcam.errors import AnalysisFailed
from fieldcam.safe_path import PYTHON

KEPT = "The picture is kept."
_PIECE_BYTES = 1 << 20
_LOG_BYTES = 1 << 20
"""A longer log is begun anew."""
_END_S = 0.9
"""A process that the kernel holds longer than this after SIGKILL is left to it."""


class AnalysisProcess:
    """One child; every method raises AnalysisFailed once it is lost."""

    def __init__(self, work: str, log: Path | None) -> None:
        command = [*PYTHON, "-m", "fieldcam.analysis.child", work, str(os.getpid())]
        try:
            with _open_log(log) as output:
                self._process = Popen(command, stdin=PIPE, stdout=PIPE, stderr=output, bufsize=0)
        except OSError as error:
            raise AnalysisFailed(
                f"The analysis cannot be started: {error.strerror}.", KEPT
            ) from error
        self._frames = Frames()

    @property
    def pid(self) -> int:
        return self._process.pid

    def fileno(self) -> int:
        """Readable when the process has said something, or ended."""
        return _stream(self._process.stdout).fileno()

    def send(self, request: Request) -> None:
        try:
            _stream(self._process.stdin).write(frame(encode_request(request)))
        except OSError as error:
            raise self._lost() from error

    def receive(self) -> Reply | None:
        """What is there of the reply is read; None until it is complete."""
        piece = os.read(self.fileno(), _PIECE_BYTES)
        if not piece:
            raise self._lost()
        try:
            for document in self._frames.feed(piece):
                return decode_reply(document)
        except FrameInvalid as error:
            raise AnalysisFailed("The analysis gave an answer that is none.", KEPT) from error
        return None

    @property
    def left_by_itself(self) -> bool:
        """Whether it was lost by a clean exit."""
        return self._process.returncode == 0

    def kill(self) -> None:
        self._process.kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Kill it, since it holds nothing that could be lost."""
        self._process.kill()
        with suppress(TimeoutExpired):
            self._process.wait(_END_S)
        for stream in (self._process.stdin, self._process.stdout):
            _stream(stream).close()

    def _lost(self) -> AnalysisFailed:
        try:
            how = _ending(self._process.wait(_END_S))
        except TimeoutExpired:
            how = "it closed its pipe"
        return AnalysisFailed(f"The analysis ended in the middle ({how}).", KEPT)


def _stream(stream: IO[bytes] | None) -> IO[bytes]:
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
