"""The route learned by walking: a tag that it does not have joins the tree that is walked."""

from __future__ import annotations

from fieldcam.codec.readings import EncodedReading
from fieldcam.session.doubt import Instead, NotNow
from fieldcam.session.viewing import WalkView
from fieldcam.store.queries.blocks import trees
from fieldcam.store.queries.history import capture_record
from fieldcam.store.queries.resuming import tree_when_taken
from fieldcam.store.rows.orchard import Cluster
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store

FIRST_TREE = "1"


def learned(view: WalkView, capture: EntryId, reading: EncodedReading) -> tuple[Cluster, ...]:
    """The row for a tag that was read and that nobody knew; none where it was known."""
    record, tag = capture_record(view.store.database, capture), reading.form.tag
    if tag is None or record is None or record.tag_id not in (None, tag.id):
        return ()
    if view.route().stop(tag.id) is not None:
        return ()
    return (new_cluster(view, capture, tag.id),)


def new_cluster(view: WalkView, capture: EntryId, tag_id: int) -> Cluster:
    """A cluster of the tree that was walked when the picture was taken."""
    block = view.route().block
    tree = tree_when_taken(view.store.database, view.visit, capture)
    return Cluster(block, tag_id, tree or _first_tree(view.store, block))


def tree_after(view: WalkView) -> EntryId:
    """The block's next tree; past its last one a new one is made."""
    route, (_, here) = view.route(), view.place()
    if route.stops and all(stop.tree is None for stop in route.stops):
        raise NotNow("Nothing says which tree these tags hang in.", Instead.GIVE_TREES)
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
