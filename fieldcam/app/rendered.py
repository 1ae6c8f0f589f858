"""What all walks of the simulated orchard have in common, with a screen or without."""

from __future__ import annotations

from fieldcam.analysis.status import Limits
from fieldcam.camera.simulated import SimulatedRow
from fieldcam.exchange.route_table import PlannedRoute, PlannedStop
from fieldcam.session.set_up.planning import keep_route
from fieldcam.store.queries.walks import is_planned
from fieldcam.store.rows.orchard import Block
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store
from fieldcam.words import number_of

OPERATOR = "demo"
CLUSTERS_PER_TREE = 2
RENDER_DEADLINE_S = 120.0
"""Rendering takes seconds, more on a busy machine; a real camera has no such excuse."""
BESIDE_RENDERING = Limits(pair_s=30.0)
"""Rendering takes the cores that the analysis has to itself in the field."""


def kept_row(store: Store, seed: int, row: SimulatedRow, walked: str) -> EntryId:
    """The row as a block of trees with its route, made when it is new; `walked` says how."""
    clusters = number_of(len(row.tag_ids), "cluster")
    block = store.block(Block(f"Row {seed}, {clusters}, walked {walked}"))
    if not is_planned(store.database, block):
        trees = (str(index // CLUSTERS_PER_TREE + 1) for index in range(len(row.tag_ids)))
        stops = tuple(map(PlannedStop, trees, row.tag_ids))
        keep_route(store, block, PlannedRoute(stops, notes=()))
    return block
