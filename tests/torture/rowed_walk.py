"""A folder with one long row to walk, and a camera that never runs out of pictures."""

from __future__ import annotations

import secrets
from pathlib import Path

from fieldcam.store.queries.walks import walk_route
from fieldcam.store.rows.orchard import Block, Cluster
from live_walks import ToldCamera
from stored_walks import FIRST_DAY, raw_pair

from fieldcam.store.folder import DataKind
from fieldcam.store.rows import EntryId
from fieldcam.store.space import Space
from fieldcam.store.store import Store, open_store
from fieldcam.values import RawPair

TAGS = tuple(range(10, 80))
SHAPE = (90, 120)
SMALL_RESERVE = 1 << 16


class QuickCamera(ToldCamera):
    """Small pictures, no two alike."""

    def capture(self, deadline_s: float) -> RawPair:
        return raw_pair(secrets.randbits(64), SHAPE)


def open_folder(folder: Path) -> Store:
    """With no gate before a capture, so that a full disk is really met."""
    return open_store(folder, DataKind.FIELD, space=Space(folder, 0, SMALL_RESERVE))


def open_row(folder: Path) -> tuple[Store, EntryId]:
    """The store, and the visit that is walked; both are made when they are new."""
    store = open_folder(folder)
    block = store.block(Block("North", "Home", "Gala", 2026))
    visit = store.visit(block, FIRST_DAY)
    if not walk_route(store.database, visit).stops:
        tree = store.tree(block, "1")
        store.append(*(Cluster(block, tag_id, tree) for tag_id in TAGS))
    return store, visit
