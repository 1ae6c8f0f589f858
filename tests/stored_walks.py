"""A store with a made-up block, for tests of what is written to it and read from it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import numpy as np
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.orchard import Block, Cluster
from fieldcam.store.rows.walk import Capture
from made_readings import TAG, made_fruitlet, made_reading
from sqlite_utils import Database

from fieldcam.store.captures import SavedCapture
from fieldcam.store.clock import Moment
from fieldcam.store.facts import CaptureFacts
from fieldcam.store.folder import DataKind
from fieldcam.store.readings import reading_row
from fieldcam.store.rows import EntryId
from fieldcam.store.space import Space
from fieldcam.store.store import Store, open_store
from fieldcam.values import PixelFormat, RawPair

START = datetime(2026, 5, 21, 9, 0, 0, tzinfo=UTC)
FIRST_DAY = date(2026, 5, 21)


def facts_without_rows(
    _database: Database, key: EntryId, capture: Capture, shutter: Moment | None
) -> CaptureFacts:
    """What stands beside a picture of a database of an older form."""
    return CaptureFacts(key, capture, shutter, None, None, None)


class SteppingClock:
    """Ten seconds pass with each look at it; it can be set like a wall clock."""

    def __init__(self) -> None:
        self._ticks = 0
        self.wall = START
        self.boot = "boot"

    def __call__(self) -> Moment:
        self._ticks += 1
        self.wall += timedelta(seconds=10)
        return Moment(self.wall, 120, self.boot, self._ticks * 10_000_000_000)


def raw_pair(seed: int = 1, shape: tuple[int, ...] = (6, 8), simulated: bool = False) -> RawPair:
    """A pair of noise; another seed is another picture."""
    rng = np.random.default_rng(seed)
    left, right = (rng.integers(0, 256, shape).astype(np.uint8) for _ in range(2))
    return RawPair(left, right, PixelFormat.BAYER_RG8, START, 5, 7, "L1", "R1", 3, simulated)


def small_store(path: Path, clock: SteppingClock | None = None) -> Store:
    """A field store that needs little room."""
    space = Space(path, needed=1 << 16, reserve=1 << 16)
    return open_store(path, DataKind.FIELD, clock or SteppingClock(), space)


class MadeWalk:
    """A block of two trees with two tags each, and short words for walking it."""

    tags: tuple[int, ...] = (11, 12, 21, 22)

    def __init__(self, store: Store) -> None:
        self.store = store
        self.block: EntryId = store.block(Block("North", "Home", "Gala", 2026))
        for tag_id in self.tags:
            tree = store.tree(self.block, f"tree {tag_id // 10}")
            store.append(Cluster(self.block, tag_id, tree))
        self._seeds: Iterator[int] = iter(range(10_000))

    def visit(self, days_later: int = 0) -> EntryId:
        return self.store.visit(self.block, FIRST_DAY + timedelta(days=days_later))

    def take(self, visit: EntryId, tag_id: int) -> SavedCapture:
        """A saved picture, not analysed."""
        raw = raw_pair(next(self._seeds))
        return self.store.save(raw, visit=visit, tag_expected=tag_id)

    def read(self, capture: EntryId, tag_read: int, fruitlets: int = 5) -> EntryId:
        """A reading of two clusters: the target of this many fruitlets, and one of three."""
        target = [
            made_fruitlet(n, (100.0 + 30 * n, 100.0), 9.0 + n, cluster=0) for n in range(fruitlets)
        ]
        others = [
            made_fruitlet(fruitlets + n, (300.0, 100.0), None, in_target=False, cluster=1)
            for n in range(3)
        ]
        reading = made_reading([*target, *others], tag=replace(TAG, id=tag_read))
        return self.store.append(reading_row(capture, reading, 400.0))[0]

    def accepted(self, capture: EntryId) -> Decision:
        return Decision(capture, Action.ACCEPT)

    def accept(self, visit: EntryId, tag_id: int, fruitlets: int = 5) -> EntryId:
        """A picture that was saved, read and accepted."""
        capture = self.take(visit, tag_id).key
        self.read(capture, tag_id, fruitlets)
        self.store.append(self.accepted(capture))
        return capture
