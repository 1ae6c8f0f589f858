"""Keeps one analysis process alive and gives it saved pairs, one after the other.

A thread does the talking; whoever submits a pair gets a future at once. The
process is that thread's own child, so the kernel ends it with the thread.
"""

from __future__ import annotations

import threading
from concurrent.futures import Future
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Self

from fieldcam.analysis.conversation import Bell
from fieldcam.analysis.glances import Glances, Tags
from fieldcam.analysis.keeper import Keeper
from fieldcam.analysis.queue import Desk, Job, Listener
from fieldcam.analysis.requests import Look, Setup
from fieldcam.analysis.status import Limits, State, Status
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ClusterReading, Expectation

VISION = "fieldcam.analysis.work:VisionWork"
DEFAULTS = Limits()


def _deaf(status: Status) -> None:
    """Nobody listens."""


class Supervisor:
    """Runs from the moment it is made until `close`."""

    def __init__(
        self,
        setup: Setup,
        log: Path | None = None,
        listener: Listener = _deaf,
        limits: Limits = DEFAULTS,
        work: str = VISION,
    ) -> None:
        """`listener` hears of changes in the supervisor's thread and must not wait for others.

        `work` names the class that the process runs, as `module:Class`; `log`
        takes what it prints.
        """
        self._close_s = limits.close_s
        self._bell = Bell()
        self._desk = Desk(self._bell, listener, limits.tries)
        self._lifecycle = threading.Lock()
        self._glances = Glances(self._bell)
        self._keeper = Keeper(self._desk, self._glances, self._bell, setup, limits, work, log)
        self._start()

    def submit(
        self,
        saved: SavedCapture,
        expectation: Expectation,
        *,
        urgent: bool = False,
        again: bool = False,
    ) -> Future[ClusterReading]:
        """The promise of a reading, at once.

        An urgent pair goes before those that wait. A pair that ended the process
        too often is refused, unless the operator asks for it `again`.
        """
        job = Job(saved, expectation)
        self._desk.submit(job, urgent, again)
        return job.future

    def look(self, image: Path, shrunk: int, calibration: Path | None = None) -> Future[Tags]:
        """The promise of a preview's tags in its own pixels; a newer preview cancels it."""
        return self._glances.submit(Look(image, shrunk, calibration))

    @property
    def status(self) -> Status:
        return self._desk.status

    @property
    def heartbeat_age_s(self) -> float:
        """Since the process last answered; while idle it is asked every few seconds."""
        return monotonic() - self._keeper.heard_s

    def restart(self) -> None:
        """Start again after STOPPED, with a clean slate; at other times nothing happens."""
        with self._lifecycle:
            if self.status.state is State.STOPPED and not self._bell.closing.is_set():
                self._glances.open()
                self._desk.open()
                self._start()

    def close(self) -> None:
        """End for good; pairs that wait fail."""
        with self._lifecycle:
            if self._bell.closing.is_set():
                return
            self._bell.close()
        if self._thread is threading.current_thread():
            return
        self._thread.join(self._close_s)
        if self._thread.is_alive():
            self._keeper.kill()
        else:
            self._bell.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _start(self) -> None:
        # A daemon, so that an app which forgets to close can still end.
        self._thread = threading.Thread(target=self._keeper.run, name="analysis", daemon=True)
        self._thread.start()
