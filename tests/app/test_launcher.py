"""The terminal is given back clean, whatever ends the screens."""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import termios
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from terminals import Terminal

from fieldcam.cli import launcher
from fieldcam.errors import FieldcamError


def say(words: str) -> None:
    sys.stdout.write(words)
    sys.stdout.flush()


def kill_itself(number: int) -> None:
    os.kill(os.getpid(), number)


def crash() -> None:
    faulthandler.disable()
    kill_itself(signal.SIGSEGV)


ENDS: dict[str, tuple[Callable[[], object], int, str]] = {
    "killed": (lambda: kill_itself(signal.SIGKILL), 137, "by the system (Killed)"),
    "stopped": (lambda: kill_itself(signal.SIGQUIT), 131, "by the system (Quit)"),
    "crashed": (crash, 70, "crashed (Segmentation fault)"),
    "ended": (lambda: None, 0, "ended well"),
    "failed": (lambda: sys.exit(4), 4, ""),
    "left": (lambda: os._exit(0), 0, "ended well"),
}


def wait() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    say("waiting")
    signal.pause()


def started(deed: Callable[[], object]) -> Terminal:
    """A launcher whose screens take the terminal, do this and give nothing back."""

    def screens() -> None:
        tty.setraw(0)
        sys.stderr.write("\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[?1000h\x1b[>25u")
        sys.stderr.flush()
        deed()

    def run() -> None:
        try:
            launcher.launch(screens)
            say("ended well")
        except FieldcamError as lost:
            say(lost.message)
            sys.exit(lost.exit_code)

    return Terminal(run)


@pytest.mark.parametrize("how", ENDS)
def test_the_terminal_is_put_in_order(how: str) -> None:
    deed, status, sentence = ENDS[how]
    with started(deed) as terminal:
        assert terminal.ended() == status
        assert sentence in terminal.seen
        assert terminal.left_on() == []


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_what_is_sent_to_the_launcher_is_meant_for_the_screens(number: int) -> None:
    with started(wait) as terminal:
        terminal.wait_for("waiting")
        os.kill(terminal.pid, number)
        terminal.ended()
        assert "were killed" in terminal.seen
        assert terminal.left_on() == []


def test_ctrl_c_reaches_the_screens_once() -> None:
    """As long as they have not made a key of it, the terminal sends it to both processes."""

    def count() -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        termios.tcsetattr(0, termios.TCSANOW, cooked)
        say("waiting")
        signal.sigwait([signal.SIGINT])
        say("twice" if signal.sigtimedwait([signal.SIGINT], 0.2) else "once")
        os._exit(0)

    cooked: list[Any] = []

    def run() -> None:
        cooked.extend(termios.tcgetattr(0))
        launcher.launch(count)

    with Terminal(run) as terminal:
        terminal.wait_for("waiting")
        terminal.press("\x03")
        assert terminal.ended() == 0
        assert "once" in terminal.seen


def test_the_screens_are_asked_to_end_when_the_launcher_is_killed(tmp_path: Path) -> None:
    asked = tmp_path / "asked"

    def wait_to_be_asked() -> None:
        # A shell stands between the launcher and the session, so the kernel would not hang up.
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, lambda number, frame: asked.touch())
        wait()

    with started(wait_to_be_asked) as terminal:
        terminal.wait_for("waiting")
        os.kill(terminal.pid, signal.SIGKILL)
        terminal.ended()
        terminal.all_ended()
        assert asked.exists()


def test_a_terminal_that_was_closed_meanwhile_is_no_defect() -> None:
    usual, asked = termios.tcgetattr, [False]

    def closed_after_the_first(terminal: int) -> list[int | list[bytes | int]]:
        if asked[0]:
            raise termios.error(5, "Input/output error")
        asked[0] = True
        return usual(terminal)

    def run() -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(termios, "tcgetattr", closed_after_the_first)
            launcher.launch(lambda: None)
            say("ended well")

    with Terminal(run) as terminal:
        assert terminal.ended() == 0
        assert "ended well" in terminal.seen


def test_without_a_terminal_the_screens_run_in_this_process(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(os, "fork", None)
    ran: list[int] = []
    launcher.launch(lambda: ran.append(os.getpid()))
    assert ran == [os.getpid()]
