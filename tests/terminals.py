"""Processes in a terminal of their own, and what they leave of it."""

from __future__ import annotations

import fcntl
import os
import re
import select
import signal
import struct
import sys
import termios
import traceback
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Self

PATIENCE_S = 30.0
ESCAPE = re.compile(
    r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\)|[PX^_][^\x1b]*\x1b\\|.)"
)
_MODE = re.compile(r"\x1b\[\?([0-9;]+)([hl])")
_KEYBOARD = re.compile(r"\x1b\[([<>])[0-9]*u")
_USUALLY_ON = {"7", "25"}
"""Line wrap and the cursor."""


class Terminal:
    """A pseudo-terminal with a process in front of it; used by one thread."""

    def __init__(self, run: Callable[[], object], size: tuple[int, int] = (80, 24)) -> None:
        """`run` is called in a forked process, which leads a session of its own."""
        self._master, self._slave = os.openpty()
        columns, rows = size
        fcntl.ioctl(self._slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self._before = termios.tcgetattr(self._slave)
        self._seen = bytearray()
        self._status: int | None = None
        self.pid = os.fork()
        if self.pid == 0:
            _in_front_of(self._slave, self._master, run)
        os.set_blocking(self._master, False)

    @property
    def seen(self) -> str:
        """All that was written so far, control sequences included."""
        return self._seen.decode(errors="replace")

    def press(self, keys: str) -> None:
        """A byte that is no UTF-8 is a surrogate, as in file names."""
        with suppress(OSError):
            os.write(self._master, keys.encode(errors="surrogateescape"))

    def wait_for(self, text: str, since: int = 0, patience_s: float = PATIENCE_S) -> None:
        """Until this text is there, behind the `since`-th character."""
        until_s = monotonic() + patience_s
        while text not in ESCAPE.sub("", self.seen[since:]):
            assert monotonic() < until_s, f"{text!r} never came: {self.seen[-2000:]!r}"
            assert self._status is None or self.look(0), f"ended before {text!r}"
            self.look(0.05)
            self._ask_for_status()

    def look(self, longest_s: float) -> bool:
        """Take in what is written within this time; whether anything was."""
        if not select.select([self._master], [], [], longest_s)[0]:
            return False
        try:
            piece = os.read(self._master, 1 << 16)
        except OSError:
            return False  # nobody is in front of it any more
        self._seen += piece
        return bool(piece)

    def look_on(self, seconds: float) -> None:
        """Take in what is written during this time."""
        until_s = monotonic() + seconds
        while (left_s := until_s - monotonic()) > 0:
            self.look(left_s)

    def ended(self, patience_s: float = PATIENCE_S) -> int:
        """The exit code of the process, or minus its signal, once it has ended."""
        until_s = monotonic() + patience_s
        while self._status is None:
            assert monotonic() < until_s, f"it never ended: {self.seen[-2000:]!r}"
            self.look(0.01)
            self._ask_for_status()
        while self.look(0):
            pass
        return os.waitstatus_to_exitcode(self._status)

    def all_ended(self, patience_s: float = PATIENCE_S) -> None:
        """Until no process has this terminal open any more."""
        os.close(self._slave)
        self._slave = -1
        until_s = monotonic() + patience_s
        while monotonic() < until_s:
            poll = select.poll()
            poll.register(self._master, select.POLLIN)
            if any(event & select.POLLHUP for _, event in poll.poll(50)) and not self.look(0):
                return
            self.look(0)
        raise AssertionError("some process never ended")

    def left_on(self) -> list[str]:
        """What the next program would find otherwise than this one did."""
        last = {
            number: letter == "h"
            for numbers, letter in _MODE.findall(self.seen)
            for number in numbers.split(";")
        }
        found = [f"?{n}" for n, on in last.items() if on != (n in _USUALLY_ON)]
        keyboards = _KEYBOARD.findall(self.seen)
        if keyboards and keyboards[-1] == ">":
            found.append("keyboard protocol")
        if termios.tcgetattr(self._master) != self._before:
            found.append("line settings")
        return found

    def close(self) -> None:
        """Kill what is left of it."""
        if self._status is None:
            with suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGKILL)
            _, self._status = os.waitpid(self.pid, 0)
        for descriptor in (self._master, self._slave):
            if descriptor >= 0:
                os.close(descriptor)
        self._master = self._slave = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask_for_status(self) -> None:
        if self._status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self._status = status if pid else None


def _in_front_of(slave: int, master: int, run: Callable[[], object]) -> None:
    """The forked process's whole life."""
    status = 1
    try:
        os.setsid()
        fcntl.ioctl(slave, termios.TIOCSCTTY, 0)
        for stream in (0, 1, 2):
            os.dup2(slave, stream)
        os.close(slave)
        os.close(master)
        sys.stdin, sys.stdout, sys.stderr = (os.fdopen(n, mode) for n, mode in enumerate("rww"))
        for size in ("COLUMNS", "LINES"):
            os.environ.pop(size, None)  # of another terminal; they would come before this one's
        run()
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        os._exit(status)
