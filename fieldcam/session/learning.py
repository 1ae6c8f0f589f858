"""The route learned by walking: a tag that it does not have joins the tree that is walked."""

from __future__ import annotations

from fieldcam.session.doubt import NotNow
from fieldcam.session.viewing import WalkView
from fieldcam.store.queries.blocks import trees
from fieldcam.store.queries.history import capture_record
from fieldcam.store.queries.resuming import tree_when_taken
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.orchard import Cluster
from fieldcam.store.store import Store
from fieldcam.values import ClusterReading

FIRST_TREE = "1"
NO_TREES = "Nothing says which tree these tags hang in: Set-up (E, Route) takes it from a CSV file."


def learned(view: WalkView, capture: EntryId, reading: ClusterReading) -> tuple[Cluster, ...]:
    """The row for a tag that was read and that nobody knew; none where it was known."""
    record = capture_record(view.store.database, capture)
    if reading.tag is None or record is None or record.tag_id not in (None, reading.tag.id):
        return ()
    if view.route().stop(reading.tag.id) is not None:
        return ()
    return (new_cluster(view, capture, reading.tag.id),)


def new_cluster(view: WalkView, capture: EntryId, tag_id: int) -> Cluster:
    """A cluster of the tree that was walked when the picture was taken."""
    block = view.route().block
    tree = tree_when_taken(view.store.database, view.visit, capture)
    return Cluster(block, tag_id, tree or _first_tree(view.store, block))


def tree_after(view: WalkView) -> EntryId:
    """The block's next tree; past its last one a new one is made."""
    route, (_, here) = view.route(), view.place()
    if route.stops and all(stop.tree is None for stop in route.stops):
        raise NotNow(NO_TREES)
    known = trees(view.store.database, route.block)
    if here is None:
        return _first_tree(view.store, route.block)
    following = [*known][[*known].index(here) + 1 :] if here in known else []
    if following:
        return following[0]
    if all(stop.tree != here for stop in route.stops):
        raise NotNow(f"Tree {known.get(here, '?')} has no cluster yet.")
    number = len(known) + 1
    while str(number) in known.values():
        number += 1
    return view.store.tree(route.block, str(number))


def _first_tree(store: Store, block: EntryId) -> EntryId:
    known = trees(store.database, block)
    return next(iter(known), None) or store.tree(block, FIRST_TREE)
