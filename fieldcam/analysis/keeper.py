"""The thread that keeps an analysis process alive and talks to it."""

from __future__ import annotations

from pathlib import Path
from time import monotonic

from fieldcam.analysis.conversation import Bell, Conversation
from fieldcam.analysis.glances import Glance, Glances
from fieldcam.analysis.process import KEPT, AnalysisProcess
from fieldcam.analysis.queue import Desk, Job
from fieldcam.analysis.replies import Failed, Read, Seen
from fieldcam.analysis.requests import Analyse, Ping, Setup, WarmUp
from fieldcam.analysis.restarts import RestartWindow
from fieldcam.analysis.status import Limits, State
from fieldcam.errors import AnalysisFailed, AnalysisOff

DEFECT = AnalysisOff("The analysis is off, by a defect of fieldcam.", KEPT)


class Keeper:
    """Runs in one thread only, but for `kill`; the process is that thread's own child."""

    def __init__(
        self,
        desk: Desk,
        glances: Glances,
        bell: Bell,
        setup: Setup,
        limits: Limits,
        work: str,
        log: Path | None,
    ) -> None:
        self._desk, self._glances, self._bell = desk, glances, bell
        self._setup, self._limits, self._work, self._log = setup, limits, work, log
        self._process: AnalysisProcess | None = None
        self.heard_s = monotonic()

    def kill(self) -> None:
        """End the process from outside, where the thread itself is held up."""
        if self._process is not None:
            self._process.kill()

    def run(self) -> None:
        window = RestartWindow(self._limits.restarts, self._limits.span_s)
        reason = DEFECT
        try:
            while (ending := self._live()) is None and window.allow():
                self._desk.enter(State.RESTARTING)
            reason = ending or _given_up(self._limits)
        finally:
            self._desk.shut(reason)
            self._glances.shut(reason)

    def _live(self) -> AnalysisOff | None:
        """Serve with one process as long as it lives; None when another one should follow."""
        try:
            with AnalysisProcess(self._work, self._log) as process:
                self._process = process
                self._serve(Conversation(process, self._bell))
        except AnalysisOff as off:
            return off
        except AnalysisFailed as lost:
            self._desk.note(lost.message)
        return None

    def _serve(self, talk: Conversation) -> None:
        deadline_s = self._limits.first_pair_s
        reply = talk.ask(WarmUp(self._setup), deadline_s)
        self.heard_s = monotonic()
        if isinstance(reply, Failed):
            self._desk.note(reply.error.message)
        while True:
            talk.check()
            if (glance := self._glances.take()) is not None:
                self._look(talk, glance, deadline_s)
                continue  # what came meanwhile has rung already
            job = self._desk.take()
            if job is None:
                self._rest(talk)
                continue
            self._read(talk, job, deadline_s)
            deadline_s = self._limits.pair_s

    def _rest(self, talk: Conversation) -> None:
        self._desk.enter(State.READY)
        if not talk.rest(self._limits.ping_every_s):
            talk.ask(Ping(), self._limits.pair_s)
            self.heard_s = monotonic()

    def _look(self, talk: Conversation, glance: Glance, deadline_s: float) -> None:
        """Before the pairs that wait, since it takes no time and the operator aims by it."""
        try:
            reply = talk.ask(glance.look, deadline_s)
            if not isinstance(reply, Seen | Failed):
                raise AnalysisFailed("The analysis gave an answer that is none.", KEPT)
        except AnalysisFailed as lost:
            glance.answer(lost)
            raise
        self.heard_s = monotonic()
        glance.answer(reply.tags if isinstance(reply, Seen) else reply.error)

    def _read(self, talk: Conversation, job: Job, deadline_s: float) -> None:
        self._desk.enter(State.BUSY)
        try:
            reply = talk.ask(Analyse(job.saved, job.expectation), deadline_s)
            if not isinstance(reply, Read | Failed):
                raise AnalysisFailed("The analysis gave an answer that is none.", KEPT)
        except AnalysisOff:
            raise  # everything that waits will be told
        except AnalysisFailed as lost:
            self._desk.blame(lost)
            raise
        self.heard_s = monotonic()
        self._desk.answer(reply.reading if isinstance(reply, Read) else reply.error)


def _given_up(limits: Limits) -> AnalysisOff:
    return AnalysisOff(
        f"The analysis ended {limits.restarts + 1} times within {limits.span_s:g} s and is off.",
        "The pictures are kept. Start the analysis again, or analyse them in the evening.",
    )
