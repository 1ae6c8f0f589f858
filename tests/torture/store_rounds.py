"""Programs that test_store_torture.py runs apart, since they kill or fill what they use.

    python -m torture.store_rounds kill FOLDER ROUNDS SEED
    python -m torture.store_rounds full FOLDER        (a small file system of its own)
    python -m torture.store_rounds begin-full FOLDER  (the same)
    python -m torture.store_rounds read-only FOLDER   (mounted read-only, with a store in it)

The result is one JSON document on stdout.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.store.recovery.integrity import full_check, rehash
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.rows.judgements import Note
from stored_walks import FIRST_DAY, MadeWalk, raw_pair, small_store

from fieldcam.errors import StorageError, StorageFull
from fieldcam.store.connection import connect_read_only, rows
from fieldcam.store.folder import DataKind
from fieldcam.store.space import Space
from fieldcam.store.store import Store, open_store


def kill_rounds(folder: Path, rounds: int, seed: int) -> dict[str, Any]:
    """A writer is killed at a random moment, again and again."""
    chance = random.Random(seed)
    acknowledged: list[str] = []
    for number in range(rounds):
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            write_for_ever(folder, number * 10_000, writer)
        os.close(writer)
        if number % 4:
            os.read(reader, 1)  # it has opened the store; else it is killed while it does
        time.sleep(chance.uniform(0.0, 0.12))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        assert os.WIFSIGNALED(status), "the writer ended by itself"
        with os.fdopen(reader) as stream:
            acknowledged += [line for line in stream.read().splitlines() if line]
    with small_store(folder) as store:
        report = startup_check(store)
        return {**state(store, acknowledged), "taken_up": len(report.taken_up.captures)}


def write_for_ever(folder: Path, first: int, acknowledge: int) -> None:
    store = small_store(folder)
    walk = MadeWalk(store)
    visit = walk.visit()
    os.write(acknowledge, b"\n")
    for number in range(first, first + 10_000):
        saved = store.save(raw_pair(number), visit=visit, tag_expected=11)
        os.write(acknowledge, f"{saved.key}\n".encode())


def fill(folder: Path) -> dict[str, Any]:
    """Pictures and then rows until nothing goes any more."""
    space = Space(folder, needed=0, reserve=1 << 18)
    saved: list[str] = []
    with open_store(folder, DataKind.FIELD, space=space) as store:
        startup_check(store)
        pictures_ended = ended(
            lambda: saved.append(store.save(raw_pair(len(saved), (90, 120))).key)
        )
        rows_ended = ended(lambda: store.append(Note("x" * 2000)))
        result = state(store, saved)
    return {**result, "pictures": pictures_ended, "rows": rows_ended}


def begin_full(folder: Path) -> dict[str, Any]:
    """Images without a row, and then no byte of room for them; and then room again."""
    with small_store(folder) as store:
        visit = MadeWalk(store).visit()
        store.save(raw_pair(1), visit=visit, tag_expected=11)
        for size in range(1, 40):
            store.objects.keep(bytes(size), ".pgm")
    ballast = folder / "ballast"
    with suppress(OSError), ballast.open("wb", buffering=0) as stream:
        while stream.write(bytes(512)):
            pass
    with small_store(folder) as store:
        left = startup_check(store).taken_up.left
        setup = SetUp(store, lambda: FIRST_DAY)
        setup.resume()
        opened = setup.visit == visit
    ballast.unlink()
    with small_store(folder) as store:
        return {"left": left, "opened": opened, "loose": len(startup_check(store).taken_up.loose)}


def ended(step: Callable[[], object]) -> str:
    """The name of the error that ends the repetition."""
    for _ in range(10_000):
        try:
            step()
        except StorageFull as error:
            return type(error).__name__
    return "never"


def look(folder: Path) -> dict[str, Any]:
    """A store that cannot be written can be read."""
    try:
        small_store(folder)
        hint = ""
    except StorageError as error:
        hint = error.hint
    reader = connect_read_only(folder / "fieldcam.db")
    return {"hint": hint, "devices": rows(reader, "SELECT count(*) AS n FROM device")[0]["n"]}


def state(store: Store, acknowledged: list[str]) -> dict[str, Any]:
    full_check(store.database)
    known = {row["id"] for row in rows(store.database, "SELECT id FROM capture")}
    seqs = [row["seq"] for row in rows(store.database, "SELECT seq FROM entry ORDER BY seq")]
    return {
        "acknowledged": len(acknowledged),
        "lost": len(set(acknowledged) - known),
        "broken": len(rehash(store.database, store.objects)),
        "gaps": seqs != list(range(1, len(seqs) + 1)),
    }


def main(what: str, folder: str, *numbers: str) -> None:
    if what == "kill":
        result = kill_rounds(Path(folder), *map(int, numbers))
    elif what == "full":
        result = fill(Path(folder))
    elif what == "begin-full":
        result = begin_full(Path(folder))
    else:
        result = look(Path(folder))
    sys.stdout.write(json.dumps(result))


if __name__ == "__main__":
    main(*sys.argv[1:])
