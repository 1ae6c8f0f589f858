"""kill -9 of the app, of its analysis and of its launcher, at random moments.

The real app runs in a terminal of its own and is walked by random keys, with a
camera and an analysis that are made up. After each death the next app opens what
the last one left; what had been announced must still be there, and the terminal
must be as it was found.
"""

from __future__ import annotations

import os
import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from made_readings import CAMERA
from processes import children
from terminals import Terminal

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import Limits
from fieldcam.analysis.supervisor import Supervisor
from fieldcam.app.running import run
from fieldcam.cli.launcher import launch
from fieldcam.errors import ScreenLost, Stopped
from fieldcam.session.events import Listener, LiveEvent
from fieldcam.session.live import LiveWalk
from fieldcam.store.connection import connect_read_only
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import DATABASE_NAME, Store
from torture.inspection import Announced, Losses, announcement, inspect, missing
from torture.paths import IMPORTS
from torture.rowed_walk import QuickCamera, open_folder, open_row
from torture.treacherous import TREACHEROUS

LIMITS = Limits(pair_s=0.4, first_pair_s=30.0, restarts=100_000)
LIVES_IN_A_FOLDER = 20
KEYS = " " * 12 + "\r" * 6 + "rfhsukyd\t"
LONGEST_S = 0.8


@dataclass(slots=True)
class Tally:
    """What was killed, and what it cost."""

    kills: Counter[str] = field(default_factory=Counter)
    lives: int = 0
    terminals_broken: int = 0
    losses: Losses = field(default_factory=Losses)


def rounds(folder: Path, kills: int, seed: int) -> Tally:
    """Lives of the app until this many kills are done."""
    os.environ |= IMPORTS  # the analysis finds its made-up work there
    tally, chance = Tally(), Random(seed)
    while tally.kills.total() < kills:
        with TemporaryDirectory(dir=folder) as data:
            _one_folder(Path(data), kills, chance, tally)
    return tally


def _one_folder(data: Path, kills: int, chance: Random, tally: Tally) -> None:
    announced = Announced()
    for _ in range(LIVES_IN_A_FOLDER):
        if tally.kills.total() < kills:
            _live(data, announced, chance, tally)
            _look(data, announced)
    with open_folder(data) as store:
        tally.losses += inspect(store, announced)


def _look(data: Path, announced: Announced) -> None:
    """At once, before the next app could hide a loss."""
    if announced.pictures or announced.rows:
        database = connect_read_only(data / DATABASE_NAME)
        assert missing(database, announced) == 0, f"lost in {data}"
        database.close()


def _live(data: Path, announced: Announced, chance: Random, tally: Tally) -> None:
    """One app, from its start to a violent death."""
    with _app(data, announced) as terminal:
        up = chance.random() < 0.8  # else it is killed while it starts
        if up:
            terminal.wait_for("North")
        for _ in range(chance.randint(0, 2)):
            _walk(terminal, chance)
            tally.kills["analysis"] += _kill(children(_app_in(terminal)))
        _walk(terminal, chance)
        # Nobody is left to clean up when the launcher dies before the app can do so.
        victim = chance.choice([death for death in DEATHS if up or death != "launcher"])
        DEATHS[victim](terminal)
        tally.kills[victim] += 1
        terminal.ended()
        if victim == "launcher":
            terminal.all_ended()
        tally.terminals_broken += bool(terminal.left_on())
    tally.lives += 1


def _walk(terminal: Terminal, chance: Random) -> None:
    """Press keys for a while."""
    for _ in range(chance.randint(0, 16)):
        terminal.press(chance.choice(KEYS))
        terminal.look_on(chance.uniform(0, LONGEST_S / 16))


def _kill_app(terminal: Terminal) -> None:
    _kill([_app_in(terminal)])


def _kill_both(terminal: Terminal) -> None:
    app = _app_in(terminal)
    _kill([*children(app), app])


def _kill_launcher(terminal: Terminal) -> None:
    _kill([terminal.pid])


DEATHS = {"app": _kill_app, "app and analysis": _kill_both, "launcher": _kill_launcher}


def _kill(processes: list[int]) -> bool:
    for process in processes:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    return bool(processes)


def _app_in(terminal: Terminal) -> int:
    """The launcher's child; the kernel's list of children may miss one that is busy."""
    while not (found := children(terminal.pid)):
        terminal.look(0.001)
    return found[0]


@contextmanager
def _app(data: Path, announced: Announced) -> Iterator[Terminal]:
    """The app in a terminal; what it announced until its end is noted."""
    reader, writer = os.pipe()
    try:
        with Terminal(partial(_run_app, data, writer)) as terminal:
            os.close(writer)
            yield terminal
    finally:
        with os.fdopen(reader) as stream:
            for line in stream.read().splitlines():
                announced.hear(line)


def _run_app(data: Path, announce: int) -> None:
    with suppress(ScreenLost, Stopped):
        launch(partial(_screens, data, announce))


def _screens(data: Path, announce: int) -> None:
    store, visit = open_row(data)
    with store:
        run(partial(_start, store, visit, announce), startup_check(store).sentences)


def _start(store: Store, visit: EntryId, announce: int, listener: Listener) -> LiveWalk:
    def tell(event: LiveEvent) -> None:
        os.write(announce, f"{announcement(store.database, event)}\n".encode())
        listener(event)

    return LiveWalk(
        store,
        visit,
        QuickCamera().open,
        lambda changed: Supervisor(Setup(CAMERA), None, changed, LIMITS, TREACHEROUS),
        tell,
    )
