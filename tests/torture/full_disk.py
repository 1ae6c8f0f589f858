"""A disk that fills up while a row is walked, again and again.

    python -m torture.full_disk FOLDER ROUNDS SEED

FOLDER is a small file system of its own. A ballast leaves a little room, another
amount each time, and grows while pictures are taken and decisions made; then it
goes, and the walk must go on. The result is one JSON document on stdout.
"""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from queue import Queue
from random import Random

from live_walks import ToldAnalysis, read

from fieldcam.session.commands import Accept, Command, GoTo, Shoot, SkipCluster
from fieldcam.session.events import Done, Doubted, LiveEvent, Refused, Saved, StorageTrouble
from fieldcam.session.live import LiveWalk
from torture.inspection import Announced, Losses, announcement, inspect
from torture.rowed_walk import QuickCamera, open_row

PATIENCE_S = 60.0
STEPS = 40
"""Pictures and decisions in a round; the disk is full long before the last one."""
ROOM_BYTES = (40_000, 1_500_000)
OUTCOMES = (Saved, Done, Doubted, Refused, StorageTrouble)


@dataclass(slots=True)
class Filled:
    """What was said, and what it cost."""

    said: dict[str, int] = field(default_factory=dict)
    did_not_go_on: int = 0
    """Rounds after which there was room again and yet nothing could be saved."""
    losses: Losses = field(default_factory=Losses)


class Ballast:
    """A file that takes up room on the disk."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def leave(self, free: int) -> None:
        """Fill the disk until only this many bytes are free."""
        with self._path.open("ab") as stream:
            surplus = shutil.disk_usage(self._path.parent).free - free
            for _ in range(max(0, surplus) // 4096):
                stream.write(bytes(4096))

    def drop(self) -> None:
        self._path.unlink()


def fill(folder: Path, rounds: int, seed: int) -> Filled:
    """Every round has a data folder of its own."""
    chance, found = Random(seed), Filled()
    for number in range(rounds):
        data = folder / str(number)
        _round(data, Ballast(folder / "ballast"), chance, found)
        shutil.rmtree(data)
    return found


def _round(data: Path, ballast: Ballast, chance: Random, found: Filled) -> None:
    announced, heard = Announced(), Queue[LiveEvent]()
    store, visit = open_row(data)
    with store:
        store.space.set_aside()
        ballast.leave(chance.randint(*ROOM_BYTES))
        analysis = ToldAnalysis()
        walk = LiveWalk(store, visit, QuickCamera().open, lambda changed: analysis, heard.put)
        for step in range(STEPS):
            analysis.outcomes = [read(10 + step)]
            commands: list[Command] = [Shoot(), Shoot(), Accept(), SkipCluster()]
            walk.do(chance.choice(commands))
            said = _outcome(heard)
            name = type(said).__name__
            found.said[name] = found.said.get(name, 0) + 1
            if not isinstance(said, StorageTrouble):
                announced.hear(announcement(store.database, said))
        ballast.drop()
        walk.do(GoTo(79))
        _outcome(heard)
        walk.do(Shoot())
        found.did_not_go_on += not _saved_at_last(heard)
        walk.close()
        found.losses += inspect(store, announced)


def _outcome(heard: Queue[LiveEvent]) -> LiveEvent:
    """What came of a command; that a picture is being taken is not the last word."""
    while True:
        event = heard.get(timeout=PATIENCE_S)
        under_way = isinstance(event, Done) and event.sentence.startswith("Taking")
        if isinstance(event, OUTCOMES) and not under_way:
            return event


def _saved_at_last(heard: Queue[LiveEvent]) -> bool:
    while not isinstance(event := _outcome(heard), Saved):
        if isinstance(event, StorageTrouble):
            return False
    return True


if __name__ == "__main__":
    filled = fill(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
    sys.stdout.write(json.dumps(asdict(filled)))
