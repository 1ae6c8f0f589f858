"""What a power cut leaves of a walk, rebuilt from its trace and opened.

    python -m torture.power_cuts FOLDER [FLAW]     (walks; run under strace)

The trace says which writes, syncs and renames happened and when a picture was
announced as saved. At each call the power is cut: what was not synced is gone, or
there, or there in part. A FLAW leaves out a sync, to show that this finds it.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from queue import Queue
from random import Random
from tempfile import TemporaryDirectory
from unittest.mock import patch

from live_walks import ToldAnalysis, read
from sqlite_utils import Database

from fieldcam.errors import StorageError
from fieldcam.session.events import Done, LiveEvent, Saved, VerdictReady
from fieldcam.session.live import LiveWalk
from fieldcam.store.connection import connect
from fieldcam.store.rows import EntryId
from fieldcam.store.store import Store
from torture.disks import Disk, some
from torture.inspection import Announced, Losses, announcement, inspect
from torture.paths import IMPORTS
from torture.rowed_walk import QuickCamera, open_folder, open_row
from torture.traces import COMMAND, calls

SHARES = (0.0, 0.5, 0.9, 1.0)
"""Of what was not durable at the cut; the parts are drawn at random."""
LOG_PAGES = 60
"""The database is brought up to date from its log this often, to have cuts in that too."""
PATIENCE_S = 60.0


@dataclass(slots=True)
class Cuts:
    """How many states were opened, and what was missing in them."""

    states: int = 0
    losses: Losses = field(default_factory=Losses)


def recorded_and_cut(folder: Path, pictures: int, every: int, seed: int, flaw: str = "") -> Cuts:
    """As many states as there are calls and shares, in a folder of their own."""
    scratch = folder / "states"
    scratch.mkdir(parents=True)
    return cut(record(folder, pictures, flaw), folder / "data", scratch, seed, every)


def record(folder: Path, pictures: int, flaw: str = "") -> Path:
    """Walk under strace; gives the trace. The walk's folder is `folder/data`."""
    trace = folder / "trace"
    walk = [sys.executable, "-m", "torture.power_cuts", str(folder / "data"), str(pictures), flaw]
    environment = os.environ | IMPORTS | {"PYTHONDONTWRITEBYTECODE": "1"}
    command = [*COMMAND, str(trace), *walk]
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
    return trace


def cut(trace: Path, root: Path, scratch: Path, seed: int, every: int = 1) -> Cuts:
    """Cut the power after each `every`-th call that changed something."""
    chance, found, announced = Random(seed), Cuts(), Announced()
    disk = Disk(root)
    with trace.open() as lines:
        for number, call in enumerate(calls(lines)):
            for line in disk.replay(call).decode().splitlines():
                announced.hear(line)
            if number % every or not disk.changed:
                continue
            for share in SHARES:
                found.states += 1
                found.losses += _opened(disk, root, scratch, announced, share, chance)
    return found


def _opened(
    disk: Disk, root: Path, scratch: Path, announced: Announced, share: float, chance: Random
) -> Losses:
    """The losses in one state of the disk."""
    with TemporaryDirectory(dir=scratch) as state:
        data = Path(state) / "data"
        for path, content in disk.contents(some(chance, share)):
            _restore(data / path.relative_to(root), content)
        try:
            store = open_folder(data)
        except StorageError:
            return Losses(len(announced.pictures), damaged=1)
        with store:
            return inspect(store, announced)


def _restore(path: Path, content: bytes | None) -> None:
    if not path.parent.is_dir() or path.name.endswith("-shm"):
        return  # lost with its folder; SQLite makes the shared index anew
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)


def walk(folder: Path, pictures: int) -> None:
    """Two sittings, each with pictures, readings and decisions, and an end."""
    for _ in range(2):
        store, visit = open_row(folder)
        with store:
            _sit(store, visit, pictures)


def _sit(store: Store, visit: EntryId, pictures: int) -> None:
    heard, analysis = Queue[LiveEvent](), ToldAnalysis()
    live = LiveWalk(store, visit, QuickCamera().open, lambda changed: analysis, heard.put)
    for _ in range(pictures):
        analysis.outcomes = [read(0)]
        live.shoot()
        _tell(store.database, _next(heard, Saved))
        _tell(store.database, _next(heard, VerdictReady))
        live.skip()
        _tell(store.database, _next(heard, Done))
    live.close()


def _next(heard: Queue[LiveEvent], kind: type[LiveEvent]) -> LiveEvent:
    while not isinstance(event := heard.get(timeout=PATIENCE_S), kind):
        pass
    return event


def _tell(database: Database, event: LiveEvent) -> None:
    os.write(1, f"{announcement(database, event)}\n".encode())


def _with_short_log(path: Path) -> Database:
    database = connect(path)
    database.execute(f"PRAGMA wal_autocheckpoint={LOG_PAGES}")
    return database


def _with_lazy_log(path: Path) -> Database:
    database = _with_short_log(path)
    database.execute("PRAGMA synchronous=NORMAL")
    return database


def _nothing(what: object) -> None:
    """Is done."""


FLAWS: dict[str, dict[str, Callable[..., object]]] = {
    "": {},
    "rows": {"fieldcam.store.store.connect": _with_lazy_log},
    "images": {"fieldcam.disk.durable.os.fsync": _nothing},
    "names": {
        "fieldcam.disk.durable.fsync_folder": _nothing,
        "fieldcam.store.objects.fsync_folder": _nothing,
    },
}
"""What is not made durable, and what is put out of action for it."""


def main(folder: Path, pictures: int, flaw: str) -> None:
    with ExitStack() as stack:
        changes = {"fieldcam.store.store.connect": _with_short_log} | FLAWS[flaw]
        for name, instead in changes.items():
            stack.enter_context(patch(name, instead))
        walk(folder, pictures)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
