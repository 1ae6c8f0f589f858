"""An analysis process with a scripted work, and all that its supervisor says."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Protocol

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import AnalysisState, AnalysisStatus, Limits
from fieldcam.analysis.supervisor import Supervisor
from fieldcam.errors import FieldcamError
from fieldcam.safe_path import PYTHON
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Expectation

HERE = Path(__file__).resolve().parent
LONG_S = 60.0
"""Far more than anything here takes, but for a defect."""
PATIENT = Limits(pair_s=LONG_S, first_pair_s=LONG_S)
HASTY = Limits(pair_s=0.3, first_pair_s=LONG_S)


def scripted(work: str) -> tuple[str, ...]:
    """The command of an analysis that does what a class of `scripted_analysis` says."""
    return (*PYTHON, "-m", "scripted_analysis", work)


def pair(key: str, left: Path = Path("left.pgm")) -> SavedCapture:
    return SavedCapture(key, left, Path("right.pgm"), Path("record.json"))


class Watched:
    """A supervisor and all that its listener heard."""

    def __init__(self, setup: Setup, log: Path, limits: Limits, work: str) -> None:
        self._news = threading.Condition()
        self.heard: list[AnalysisStatus] = []
        self.supervisor = Supervisor(setup, log, self._hear, limits, scripted(work))
        self.submit = self.supervisor.submit

    def _hear(self, status: AnalysisStatus) -> None:
        with self._news:
            self.heard.append(status)
            self._news.notify_all()

    def wait_for(self, state: AnalysisState, times: int = 1) -> AnalysisStatus:
        """The status that was heard when this state was entered for the n-th time."""
        with self._news:
            assert self._news.wait_for(lambda: len(self._in(state)) >= times, LONG_S), self.heard
            return self._in(state)[times - 1]

    def settled(self) -> AnalysisStatus:
        """The status once the last that was heard is READY."""
        with self._news:
            ready = self._news.wait_for(lambda: self.heard[-1].state is AnalysisState.READY, LONG_S)
            assert ready, self.heard
            return self.heard[-1]

    def _in(self, state: AnalysisState) -> list[AnalysisStatus]:
        return [status for status in self.heard if status.state is state]

    def error(self, key: str, again: bool = False) -> FieldcamError:
        error = self.submit(pair(key), Expectation(), again=again).exception(LONG_S)
        assert isinstance(error, FieldcamError)
        assert error.message.endswith(".") and error.hint
        return error

    def reads(self, key: str = "nothing") -> bool:
        reading = self.submit(pair(key), Expectation(7, 4)).result(LONG_S)
        return (
            reading.form.expectation.value() == Expectation(7, 4) and len(reading.form.target) == 1
        )


class Watch(Protocol):
    def __call__(
        self, work: str = ..., limits: Limits = ..., data: Path | None = ...
    ) -> Watched: ...
