"""Keeps a planned route: its trees, its tags and their order, as one change."""

from __future__ import annotations

from fieldcam.exchange.route_table import PlannedRoute
from fieldcam.store.connection import writing
from fieldcam.store.queries.blocks import trees
from fieldcam.store.rows import Draft, EntryId, new_id
from fieldcam.store.rows.orchard import Cluster, Route, Tree
from fieldcam.store.store import Store
from fieldcam.words import number_of


def keep_route(store: Store, block: EntryId, route: PlannedRoute) -> str:
    """The block is walked in this order; says what was kept, and what was assumed."""
    stops = route.stops
    labels = dict.fromkeys(stop.tree for stop in stops)
    with writing(store.database):
        known = {label: tree for tree, label in trees(store.database, block).items()}
        new = {label: Draft(Tree(block, label), new_id()) for label in labels if label not in known}
        ids = known | {label: draft.id for label, draft in new.items()}
        clusters = (Cluster(block, stop.tag_id, ids[stop.tree]) for stop in stops)
        order = Route(block, tuple(stop.tag_id for stop in stops))
        # Together, so that one undo takes it back.
        store.append(*new.values(), *clusters, order)
    counted = f"The route has {number_of(len(stops), 'tag')} in {number_of(len(labels), 'tree')}."
    return " ".join([counted, *route.notes])
