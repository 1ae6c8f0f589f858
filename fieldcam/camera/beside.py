"""A process that makes pictures beside the app, which loads no library for that itself."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from fieldcam.errors import CameraUnplugged, FieldcamError
from fieldcam.parentage import die_with
from fieldcam.safe_path import keep_children_safe
from fieldcam.values import RawPair

NICENESS = 15
"""The screen and the analysis go before pictures that are made ahead; for the first one
somebody waits."""
_Answer = TypeVar("_Answer")

Make = Callable[[Any], RawPair]
Prepare = Callable[..., tuple[object, Make]]
"""Run once in the process: what is to be known beforehand, and what makes each picture."""


class PictureProcess:
    """Answers one request after the other; any thread may ask."""

    def __init__(self, prepare: Prepare, *arguments: object) -> None:
        keep_children_safe()
        context = get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._lock = threading.Lock()
        self._process = context.Process(
            target=_serve, args=(theirs, os.getpid(), prepare, *arguments), daemon=True
        )
        self._process.start()
        theirs.close()

    def about(self, kind: type[_Answer]) -> _Answer:
        """What `prepare` gave; to be asked for once, before any picture."""
        return self._received(kind)

    def picture(self, request: object) -> RawPair:
        """One picture; waits for it."""
        with self._lock:
            try:
                self._connection.send(request)
            except OSError as error:
                raise CameraUnplugged("The pictures' process has ended.") from error
            return self._received(RawPair)

    def close(self) -> None:
        """End it, in the middle of a picture too."""
        self._process.kill()
        self._process.join()

    def _received(self, kind: type[_Answer]) -> _Answer:
        """What the process is trusted to answer, or why it cannot."""
        try:
            answer: _Answer | FieldcamError = self._connection.recv()
        except (EOFError, OSError) as error:
            raise CameraUnplugged("The pictures' process has ended.") from error
        if isinstance(answer, FieldcamError):
            raise answer
        return answer


def _serve(connection: Connection, parent_pid: int, prepare: Prepare, *arguments: object) -> None:
    """The process; ends with the app, however that ends."""
    die_with(parent_pid)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (1, 2):
        os.dup2(nothing, stream)  # the terminal is the app's
    try:
        about, make = prepare(*arguments)
    except FieldcamError as error:
        connection.send(error)
        return
    connection.send(about)
    with suppress(EOFError):
        connection.send(_answer(make, connection.recv()))
        os.nice(NICENESS)
        while True:
            connection.send(_answer(make, connection.recv()))


def _answer(make: Make, request: object) -> RawPair | FieldcamError:
    try:
        return make(request)
    except FieldcamError as error:
        return error
