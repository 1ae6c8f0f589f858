"""A stored block of two clusters on two visits whose fruitlets have grown and have names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fieldcam.store.rows.fruit import CaliperIdentity
from fieldcam.store.rows.judgements import Action, Decision
from made_clusters import made_view, ring
from stored_walks import FIRST_DAY, MadeWalk, small_store

from fieldcam.store.readings import reading_row
from fieldcam.values import TagPose

START = {11: (9.0, 8.0, 7.5, 8.5), 12: (7.0, 7.5, 8.2, 9.1)}
GROWN = {11: (12.0, 9.0, 9.5, 8.9), 12: (10.5, 7.9, 8.4, 12.0)}
LATER_DAYS = 4
DAYS = (FIRST_DAY, FIRST_DAY.replace(day=FIRST_DAY.day + LATER_DAYS))


def grown_field(folder: Path) -> Path:
    """A data folder with the block North; in each cluster the fruitlets are called 1 to 4."""
    with small_store(folder) as store:
        walk = MadeWalk(store)
        for days_later, sizes in ((0, START), (LATER_DAYS, GROWN)):
            visit = walk.visit(days_later)
            for tag_id, of_tag in sizes.items():
                photograph(walk, visit, tag_id, of_tag)
    return folder


def photograph(walk: MadeWalk, visit: str, tag_id: int, sizes: Sequence[float | None]) -> None:
    capture = walk.take(visit, tag_id).key
    reading = made_view("", ring(sizes)).reading
    assert isinstance(reading.tag, TagPose)
    read = replace(reading, tag=replace(reading.tag, id=tag_id))
    (key,) = walk.store.append(reading_row(capture, read, 400.0))
    walk.store.append(Decision(capture, Action.ACCEPT))
    walk.store.append(*(CaliperIdentity(key, n, str(n + 1)) for n in range(len(sizes))))
