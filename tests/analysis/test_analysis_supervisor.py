"""The analysis may hang, crash or lie; it costs one pair, and never the app."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from random import Random
from time import perf_counter

import pytest
import watched_analysis
from made_readings import CAMERA
from recorded_pairs import write_pairs
from stored_walks import small_store
from watched_analysis import HASTY, HERE, LONG_S, Watch, pair, scripted

from fieldcam.analysis.messages import Ping, Reply, Request, Setup, WarmUp
from fieldcam.analysis.process import AnalysisProcess
from fieldcam.analysis.status import AnalysisState, AnalysisStatus, Limits
from fieldcam.analysis.supervisor import Supervisor
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import (
    AnalysisFailed,
    AnalysisOff,
    AnalysisTimeout,
    ImageUnreadable,
    ModelMissing,
)
from fieldcam.exchange.capture_folder import read_capture_folder
from fieldcam.session.importing import import_pairs
from fieldcam.store.captures import SavedCapture
from fieldcam.store.rows.orchard import Block
from fieldcam.values import Expectation


def ends_within(pid: int, seconds: float) -> float | None:
    """How long a process still lived; None when it outlived that."""
    try:
        process = os.pidfd_open(pid)
    except ProcessLookupError:
        return 0.0
    started = perf_counter()
    poll = select.poll()
    poll.register(process, select.POLLIN)
    ended = poll.poll(seconds * 1000)
    os.close(process)
    return perf_counter() - started if ended else None


def test_pairs_are_read_in_their_order_but_urgent_ones_first(watch: Watch, gate: Path) -> None:
    watched = watch("Waiting", data=gate)
    done: list[str] = []
    futures = []
    for key, urgent in (("nothing a", False), ("nothing b", False), ("nothing c", True)):
        future = watched.submit(pair(key), Expectation(), urgent=urgent)
        future.add_done_callback(lambda _, key=key: done.append(key[-1]))  # type: ignore[misc]
        futures.append(future)
    unwanted = watched.submit(pair("segfault"), Expectation())
    assert unwanted.cancel()
    assert watched.supervisor.status == AnalysisStatus(AnalysisState.STARTING, pending=4)
    gate.write_bytes(b"go")
    for future in futures:
        future.result(LONG_S)
    assert done == ["c", "a", "b"]
    assert watched.wait_for(AnalysisState.READY) == AnalysisStatus(AnalysisState.READY)


def test_the_limits_are_those_of_the_design() -> None:
    limits = Limits()
    assert (limits.pair_s, limits.restarts, limits.span_s, limits.tries) == (10, 5, 60, 2)


LOSSES = {
    "segfault": "(segmentation fault)",
    "fall": "(exit status 3)",
    "leave": "(exit status 0)",
    "garbage": "an answer that is none",
    "huge": "an answer that is none",
    "forged": "an answer that is none",
}


def test_a_lost_process_costs_only_its_own_pair(watch: Watch) -> None:
    watched = watch(limits=Limits(pair_s=LONG_S, restarts=100, tries=1))
    good = [watched.submit(pair("nothing"), Expectation())]
    bad = {}
    for key in LOSSES:
        bad[key] = watched.submit(pair(key), Expectation())
        good.append(watched.submit(pair("nothing"), Expectation()))
    for key, sentence in LOSSES.items():
        error = bad[key].exception(LONG_S)
        assert type(error) is AnalysisFailed
        assert sentence in error.message
        assert error.hint == "The picture is kept."
    assert all(future.result(LONG_S) for future in good)
    status = watched.supervisor.status
    assert status.restarts == len(LOSSES)
    assert LOSSES["forged"] in status.last_error


def test_a_pair_that_crashed_twice_is_only_tried_again_when_asked_for(watch: Watch) -> None:
    watched = watch()
    watched.error("segfault")
    assert watched.wait_for(AnalysisState.RESTARTING, 2).restarts == 2
    assert "not retried" in watched.error("segfault").message
    asked = watched.submit(pair("segfault"), Expectation(), again=True)
    watched.wait_for(AnalysisState.RESTARTING, 3)
    watched.supervisor.close()
    assert asked.exception(LONG_S) is not None


def test_a_pair_that_takes_too_long_is_ended(watch: Watch) -> None:
    watched = watch(limits=HASTY)
    for key in ("hang", "hang_with_interpreter"):
        assert watched.reads()  # the first one may take longer
        started = perf_counter()
        assert type(watched.error(key)) is AnalysisTimeout
        assert perf_counter() - started >= HASTY.pair_s
    assert watched.wait_for(AnalysisState.RESTARTING, 2).restarts == 2


def test_errors_of_ours_come_back_as_themselves_from_a_process_that_goes_on(watch: Watch) -> None:
    watched = watch()
    error = watched.error("refuse")
    assert type(error) is ImageUnreadable
    assert (error.message, error.hint) == ("The left image is empty.", "Take it again.")
    assert "ZeroDivisionError: of all things" in watched.error("stumble").message
    assert "MemoryError" in watched.error("gorge").message
    assert watched.supervisor.status.restarts == 0


def test_what_libraries_print_goes_to_the_log(
    watch: Watch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    watched = watch()
    assert watched.reads("chatter")
    watched.error("stumble")
    log = (tmp_path / "a.log").read_text()
    for words in ("printed by", "a warning", "native code", "a grandchild", "Traceback"):
        assert words in log
    assert capfd.readouterr() == ("", "")


def test_missing_networks_are_said_and_do_not_stop_the_process(watch: Watch) -> None:
    watched = watch("Untouched")
    assert type(watched.error("nothing")) is ModelMissing
    status = watched.supervisor.status
    assert status.last_error == "No stereo network is installed."
    assert status.restarts == 0


def test_after_too_many_restarts_it_is_off_until_it_is_started_again(watch: Watch) -> None:
    watched = watch("Falling", Limits(restarts=1))
    waiting = watched.submit(pair("nothing"), Expectation())
    status = watched.wait_for(AnalysisState.STOPPED)
    assert (status.restarts, status.pending) == (1, 0)
    assert "ended 2 times within 60 s" in status.last_error
    assert type(waiting.exception(LONG_S)) is AnalysisOff
    assert type(watched.error("nothing")) is AnalysisOff
    watched.supervisor.restart()
    assert watched.wait_for(AnalysisState.STOPPED, 2).restarts == 2


def test_a_process_that_leaves_by_itself_is_not_started_again(watch: Watch) -> None:
    watched = watch("Leaving")
    status = watched.wait_for(AnalysisState.STOPPED)
    assert (status.restarts, status.last_error) == (0, "The analysis left by itself.")
    watched.supervisor.restart()
    watched.wait_for(AnalysisState.READY, 2)


def test_an_idle_process_that_dies_is_replaced_before_the_next_pair(
    watch: Watch, gate: Path
) -> None:
    watched = watch()
    future = watched.submit(pair("nothing", gate), Expectation())
    pid = int(gate.read_text())
    future.result(LONG_S)
    watched.wait_for(AnalysisState.READY)
    os.kill(pid, signal.SIGINT)  # control-C in the terminal goes to all of its programs
    assert watched.reads()
    os.kill(pid, signal.SIGKILL)
    watched.wait_for(AnalysisState.RESTARTING)
    assert watched.settled().pending == 0
    assert watched.reads()


def test_an_idle_process_that_answers_no_more_is_replaced(watch: Watch) -> None:
    watched = watch("Deaf", Limits(pair_s=0.3, ping_every_s=0.3))
    assert "longer than 0.3 s" in watched.wait_for(AnalysisState.RESTARTING).last_error


def test_an_idle_process_is_asked_whether_it_lives_and_nobody_is_told(
    watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: SimpleQueue[Request] = SimpleQueue()
    ask = AnalysisProcess.ask

    def noted(process: AnalysisProcess, request: Request, deadline_s: float) -> Reply:
        asked.put(request)
        return ask(process, request, deadline_s)

    monkeypatch.setattr(AnalysisProcess, "ask", noted)
    watched = watch(limits=Limits(ping_every_s=0.02))
    kinds = [type(asked.get(timeout=LONG_S)) for _ in range(4)]
    assert kinds == [WarmUp, Ping, Ping, Ping]
    assert watched.heard == [AnalysisStatus(AnalysisState.READY)]


@pytest.mark.parametrize("key", ["hang", "hang_with_interpreter"])
def test_closing_takes_no_more_than_a_second(watch: Watch, gate: Path, key: str) -> None:
    watched = watch()
    busy = watched.submit(pair(key, gate), Expectation())
    waiting = watched.submit(pair("nothing"), Expectation())
    pid = int(gate.read_text())
    started = perf_counter()
    watched.supervisor.close()
    watched.supervisor.close()
    assert perf_counter() - started < 1.5
    assert ends_within(pid, 0) is not None
    for future in (busy, waiting, watched.submit(pair("nothing"), Expectation())):
        assert type(future.exception(LONG_S)) is AnalysisOff
    watched.supervisor.restart()
    assert watched.supervisor.status.state is AnalysisState.STOPPED


def test_closing_leaves_nothing_open(watch: Watch) -> None:
    def descriptors() -> int:
        return len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - only their number counts

    before, threads = descriptors(), threading.active_count()
    watched = watch()
    watched.error("segfault")
    watched.supervisor.close()
    assert (descriptors(), threading.active_count()) == (before, threads)


def test_it_may_be_closed_from_its_own_thread(watch: Watch) -> None:
    watched = watch()
    closed = threading.Event()

    def close(_: object) -> None:
        watched.supervisor.close()
        closed.set()

    watched.submit(pair("nothing"), Expectation()).add_done_callback(close)
    assert closed.wait(LONG_S)
    watched.wait_for(AnalysisState.STOPPED)


def test_a_log_that_cannot_be_written_stops_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PYTHONPATH", f"{HERE}{os.pathsep}{HERE.parent}")
    log = Path("/proc/nowhere/analysis.log")
    with Supervisor(Setup(CAMERA), log, child=scripted("Scripted")) as supervisor:
        assert supervisor.submit(pair("chatter"), Expectation()).result(LONG_S)


def test_an_interpreter_that_cannot_be_started_is_said(
    watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watched_analysis, "PYTHON", ("/nowhere/python", "-P"))
    watched = watch()
    status = watched.wait_for(AnalysisState.STOPPED)
    assert status.restarts == 5
    assert "cannot be started: No such file" in watched.heard[0].last_error


def test_an_import_goes_on_over_a_crash(watch: Watch, tmp_path: Path) -> None:
    watched = watch()
    tags = {17: "nothing 1", 18: "segfault", 19: "nothing 2"}

    class Keyed:
        def submit(
            self,
            saved: SavedCapture,
            expectation: Expectation,
            *,
            urgent: bool = False,
            again: bool = False,
        ) -> Future[EncodedReading]:
            assert expectation.tag_id is not None
            return watched.submit(pair(tags[expectation.tag_id]), expectation)

    folder = write_pairs(tmp_path / "season", [f"2026-05-21/{tag}_1" for tag in tags])
    captures = read_capture_folder(folder).captures
    with small_store(tmp_path / "data") as store:
        outcomes = [*import_pairs(store, Block("North"), Keyed(), captures)]
    assert [(each.file.tag_id, each.unread) for each in outcomes] == [
        (17, False),
        (19, False),
        (18, True),
    ]


PARENT = """
import sys, threading
from pathlib import Path
from fieldcam.analysis.messages import Setup
from fieldcam.analysis.supervisor import Supervisor
from fieldcam.safe_path import PYTHON
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Calibration, Expectation

camera = Calibration(640, 480, 760.0, 320.0, 240.0, 60.0)
supervisor = Supervisor(Setup(camera), child=(*PYTHON, "-m", "scripted_analysis", "Scripted"))
gate = Path(sys.argv[2])
supervisor.submit(SavedCapture(sys.argv[1], gate, gate, gate), Expectation())
print("started", flush=True)
threading.Event().wait()
"""


@pytest.fixture
def parent(monkeypatch: pytest.MonkeyPatch) -> Callable[..., subprocess.Popen[str]]:
    monkeypatch.setenv("PYTHONPATH", f"{HERE}{os.pathsep}{HERE.parent}")

    def start(key: str, gate: Path) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", PARENT, key, str(gate)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    return start


@pytest.mark.parametrize("key", ["hang", "hang_with_interpreter", "nothing"])
def test_the_process_dies_with_its_parent(
    parent: Callable[..., subprocess.Popen[str]],
    gate: Path,
    note: Callable[[str], None],
    key: str,
) -> None:
    with parent(key, gate) as app:
        pid = int(gate.read_text())
        app.kill()
        lived_s = ends_within(pid, 1.0)
        assert lived_s is not None
        note(f"analysis process ({key}) ended {lived_s * 1000:.0f} ms after kill -9 of the app")


def test_the_app_that_forgets_to_close_can_end(
    parent: Callable[..., subprocess.Popen[str]], gate: Path
) -> None:
    with parent("hang", gate) as app:
        pid = int(gate.read_text())
        app.send_signal(signal.SIGINT)  # ends the main thread's wait
        app.wait(LONG_S)
        assert ends_within(pid, 1.0) is not None


def test_the_apps_side_loads_no_vision_library() -> None:
    code = "import fieldcam.analysis.supervisor, sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"cv2", "onnxruntime", "pupil_apriltags", "scipy", "networkx"}


@pytest.mark.slow
def test_every_pair_is_answered_over_two_hundred_kills(watch: Watch, gate: Path) -> None:
    watched = watch(limits=Limits(pair_s=LONG_S, restarts=10_000, tries=1))
    random = Random(1)
    reader = os.open(gate, os.O_RDONLY | os.O_NONBLOCK)
    for number in range(200):
        future = watched.submit(pair(f"nothing {number}", gate), Expectation())
        while not select.select([reader], [], [], 0.1)[0] and not future.done():
            pass
        pid = os.read(reader, 20)
        threading.Event().wait(random.uniform(0, 0.004))
        if pid:
            with suppress(ProcessLookupError):
                os.kill(int(pid), signal.SIGKILL)
        error = future.exception(LONG_S)
        assert error is None or type(error) is AnalysisFailed
    os.close(reader)
    assert watched.supervisor.status.state is not AnalysisState.STOPPED


@pytest.mark.slow
def test_no_process_outlives_an_app_that_is_killed_at_any_moment(
    parent: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    random = Random(2)
    for _ in range(40):
        with parent("hang", tmp_path / "none") as app:
            assert app.stdout is not None and app.stdout.readline()
            threading.Event().wait(random.uniform(0, 0.6))
            children = _children(app.pid)
            app.kill()
        for pid in children | _children(app.pid):
            # One that has only begun to start must first get as far as to look for its parent.
            assert ends_within(pid, LONG_S) is not None


def _children(parent_pid: int) -> set[int]:
    """Analysis processes that were started by this one; its id is their last argument."""
    found = set()
    for entry in Path("/proc").iterdir():
        with suppress(OSError, ValueError):
            arguments = (entry / "cmdline").read_bytes().split(b"\0")
            if b"scripted_analysis" in arguments and arguments[-2] == b"%d" % parent_pid:
                found.add(int(entry.name))
    return found
