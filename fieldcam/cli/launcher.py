"""Runs the screens in a child process and puts the terminal in order behind them.

A program that is killed cannot give its terminal back: raw mode, the alternate
screen and mouse reports would stay on. The launcher holds nothing else, so it
is there to clean up whatever ends the app.
"""

from __future__ import annotations

import os
import signal
import sys
import termios
from collections.abc import Callable
from contextlib import suppress
from types import FrameType

from fieldcam.errors import FieldcamError, ScreenCrashed, ScreenLost
from fieldcam.parentage import die_with

RESET = (
    "\x1b[<u"  # the terminal's own keyboard protocol
    "\x1b[?1000l\x1b[?1003l\x1b[?1006l\x1b[?1015l\x1b[?1016l"  # mouse reports
    "\x1b[?1004l\x1b[?2004l\x1b[?2026l\x1b[?2048l"  # focus, paste, frames, sizes
    "\x1b[?1049l\x1b[?7h\x1b[?25h\x1b[0m"  # main screen, line wrap, cursor, plain colours
)
_FOR_THE_SCREENS = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
_CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGILL, signal.SIGFPE)
_KEPT = "All that was saved is kept: start again to go on where you stopped."
_launched = False
"""Whether this process is the child of a launcher."""


def launch(screens: Callable[[], None]) -> None:
    """Run the screens; both the child and this process return when they have ended.

    Raises ScreenLost where a signal ended them and ScreenCrashed where that was their
    own fault, and leaves with their own exit status where that is not zero. Call it
    before any thread is started. Screens that lead to others need no launcher for those.
    """
    global _launched
    if _launched or not sys.stdin.isatty():
        screens()
        return
    terminal, launcher = sys.stdin.fileno(), os.getpid()
    before = termios.tcgetattr(terminal)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    signal.pthread_sigmask(signal.SIG_BLOCK, _FOR_THE_SCREENS)
    child = os.fork()
    if child == 0:
        _launched = True
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _FOR_THE_SCREENS)
        die_with(launcher, signal.SIGTERM)
        screens()
        return
    status = _outlive(child, terminal)
    with suppress(termios.error):  # there is nothing to put in order where it was closed
        if os.WIFSIGNALED(status) or termios.tcgetattr(terminal) != before:
            _put_in_order(terminal, before)
    if os.WIFSIGNALED(status):
        raise _lost(os.WTERMSIG(status))
    if code := os.waitstatus_to_exitcode(status):
        sys.exit(code)  # the child has said why


def _lost(number: int) -> FieldcamError:
    name = signal.strsignal(number)
    if number in _CRASHES:
        return ScreenCrashed(f"The screens crashed ({name}).", _KEPT)
    sentence = f"The screens were killed by another program or by the system ({name})."
    return ScreenLost(sentence, _KEPT, number)


def _outlive(child: int, terminal: int) -> int:
    """How the child ended; what is sent to this process is meant for it."""

    def hand_on(number: int, frame: FrameType | None) -> None:
        if number != signal.SIGINT or not _sends_interrupts(terminal):
            os.kill(child, number)

    for number in _FOR_THE_SCREENS:
        signal.signal(number, hand_on)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _FOR_THE_SCREENS)
    while True:
        _, status = os.waitpid(child, os.WUNTRACED)
        if not os.WIFSTOPPED(status):
            return status
        # The shell takes the terminal back only when its own child stops too.
        os.kill(os.getpid(), signal.SIGSTOP)
        os.kill(child, signal.SIGCONT)


def _sends_interrupts(terminal: int) -> bool:
    """Whether Ctrl+C is a signal there, which both processes get, and not a key."""
    try:
        return bool(termios.tcgetattr(terminal)[3] & termios.ISIG)
    except termios.error:
        return False


def _put_in_order(terminal: int, before: list[int | list[bytes | int]]) -> None:
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    # What the mouse has reported meanwhile must not reach the shell.
    termios.tcflush(terminal, termios.TCIFLUSH)
    termios.tcsetattr(terminal, termios.TCSADRAIN, before)
    sys.stderr.write(RESET)
    sys.stderr.flush()
