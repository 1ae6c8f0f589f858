"""A signal in the middle: the terminal is given back, and what was taken is kept."""

from __future__ import annotations

import fcntl
import os
import signal
import struct
import termios
from pathlib import Path
from time import monotonic, sleep

import pytest
from live_walks import ToldAnalysis, ToldCamera
from stored_walks import MadeWalk, small_store
from terminals import PATIENCE_S, Terminal

from fieldcam.app.running import run
from fieldcam.cli import main
from fieldcam.errors import ExitCode
from fieldcam.session.events import Listener
from fieldcam.session.live import LiveWalk
from fieldcam.store.queries.history import visit_captures
from fieldcam.tui.questions.offer import offered
from fieldcam.tui.screens.walk_screen import WalkScreen
from fieldcam.values import RawPair

SIGNALS = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
EXPOSURE_S = 0.5


class SlowCamera(ToldCamera):
    """Exposes long enough to be ended in the middle."""

    def capture(self, deadline_s: float) -> RawPair:
        sleep(EXPOSURE_S)
        return super().capture(deadline_s)


def walk_in(folder: Path) -> None:
    """The app on a made-up block, until it is ended."""
    with small_store(folder) as store:
        visit = MadeWalk(store).visit()

        def start(listener: Listener) -> LiveWalk:
            analysis = ToldAnalysis()
            return LiveWalk(store, visit, SlowCamera().open, lambda changed: analysis, listener)

        run(start)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_while_a_picture_is_taken(
    tmp_path: Path, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fieldcam.cli.app.open_app", lambda data, parser: walk_in(data))
    with Terminal(lambda: exit(main(["--data", str(tmp_path)]))) as terminal:
        terminal.wait_for("aim, press Space")
        terminal.press(" ")
        terminal.wait_for("hold still")
        os.kill(terminal.pid, number)
        assert terminal.ended() == 128 + number
        assert terminal.left_on() == []
        assert "Finishing the picture that is being taken …" in terminal.seen
        assert terminal.seen.rstrip().endswith("fieldcam: stopped.")
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        assert len(visit_captures(store.database, made.visit())) == 1


@pytest.mark.parametrize("in_a_thread", [False, True])
def test_a_defect_of_a_screen_is_in_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, in_a_thread: bool
) -> None:
    def defect() -> None:
        raise ZeroDivisionError("a bug")

    def skip(screen: WalkScreen) -> None:
        if in_a_thread:
            screen.run_worker(defect, thread=True)
        else:
            defect()

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr("fieldcam.cli.app.open_app", lambda data, parser: walk_in(data))
    monkeypatch.setattr(WalkScreen, "action_skip", skip)
    with Terminal(lambda: exit(main(["--data", str(tmp_path)]))) as terminal:
        terminal.wait_for("aim, press Space")
        terminal.press("k")
        assert terminal.ended() == ExitCode.DEFECT
        assert terminal.left_on() == []
        assert "Traceback" not in terminal.seen and "fieldcam.log" in terminal.seen
    log = (tmp_path / "state/fieldcam/fieldcam.log").read_text()
    assert "ZeroDivisionError: a bug" in log and "in defect" in log


def test_a_signal_where_the_demo_is_offered() -> None:
    with Terminal(lambda: offered("No camera: none was found.")) as terminal:
        terminal.wait_for("DEMO")
        os.kill(terminal.pid, signal.SIGTERM)
        terminal.ended()
        assert terminal.left_on() == []


def test_the_window_shrinks_while_a_picture_is_taken(tmp_path: Path) -> None:
    with Terminal(lambda: walk_in(tmp_path)) as terminal:
        terminal.wait_for("aim, press Space")
        terminal.press(" ")
        terminal.wait_for("hold still")
        resize(terminal, 40, 10)
        terminal.wait_for("one is 40x10.")
        resize(terminal, 120, 40)
        terminal.wait_for("It is being read")
        terminal.press("qy")
        assert terminal.ended() == 0
        assert terminal.left_on() == []


def test_a_terminal_that_is_closed_ends_the_app(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fieldcam.cli.app.open_app", lambda data, parser: walk_in(data))
    terminal = Terminal(lambda: exit(main(["--data", str(tmp_path)])))
    terminal.wait_for("aim, press Space")
    pid = terminal.pid
    os.close(terminal._slave)
    os.close(terminal._master)
    terminal._master = terminal._slave = -1
    until_s = monotonic() + PATIENCE_S
    while (ended := os.waitpid(pid, os.WNOHANG)) == (0, 0):
        if monotonic() > until_s:
            terminal.close()
            pytest.fail("it never ended")
        sleep(0.05)
    assert os.waitstatus_to_exitcode(ended[1]) == 128 + signal.SIGHUP


def resize(terminal: Terminal, columns: int, rows: int) -> None:
    fcntl.ioctl(terminal._master, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
