"""An analysis that goes wrong on every single picture; the walk must not even slow down."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from queue import Queue
from tempfile import TemporaryDirectory
from typing import TypeVar

from made_readings import CAMERA

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import AnalysisState, Limits
from fieldcam.analysis.supervisor import Supervisor
from fieldcam.session.commands import Shoot
from fieldcam.session.events import AnalysisTrouble, LiveEvent, Saved, VerdictReady
from fieldcam.session.live import LiveWalk
from torture.inspection import Announced, Losses, announcement, inspect
from torture.paths import IMPORTS
from torture.rowed_walk import QuickCamera, open_row
from torture.treacherous import HOPELESS, fault_of

LIMITS = Limits(pair_s=6.0, first_pair_s=6.0, restarts=100_000, tries=1)
PATIENCE_S = 60.0
_Event = TypeVar("_Event", bound=LiveEvent)


@dataclass(slots=True)
class Suffered:
    """What each picture made the analysis do, and what it cost."""

    faults: Counter[str] = field(default_factory=Counter)
    unanswered: int = 0
    """Pictures that got neither a reading nor a reason why there is none."""
    gave_up: bool = False
    losses: Losses = field(default_factory=Losses)


def suffer(folder: Path, pictures: int) -> Suffered:
    """Take pictures whose analysis fails, each as soon as the one before is answered."""
    os.environ |= IMPORTS
    found, heard = Suffered(), Queue[LiveEvent]()
    with TemporaryDirectory(dir=folder) as data:
        store, visit = open_row(Path(data))
        with store:
            supervisors: list[Supervisor] = []

            def start(changed: object) -> Supervisor:
                supervisors.append(Supervisor(Setup(CAMERA), limits=LIMITS, child=HOPELESS))
                return supervisors[0]

            walk = LiveWalk(store, visit, QuickCamera().open, start, heard.put)
            announced = Announced()
            for _ in range(pictures):
                walk.do(Shoot())
                saved = _next(heard, Saved)
                announced.hear(announcement(store.database, saved))
                found.faults[fault_of(saved.capture, one_in=1)] += 1
                found.unanswered += _next(heard, AnalysisTrouble).capture != saved.capture
            found.gave_up = supervisors[0].status.state is AnalysisState.STOPPED
            walk.close()
            found.losses = inspect(store, announced)
    return found


def _next(heard: Queue[LiveEvent], kind: type[_Event]) -> _Event:
    while not isinstance(event := heard.get(timeout=PATIENCE_S), kind):
        assert not isinstance(event, VerdictReady)
    return event
