"""To another cluster, or another tree."""

from __future__ import annotations

from fieldcam.session.deciding.here import move_on, stand_at, standing
from fieldcam.session.deciding.learning import tree_after
from fieldcam.session.doubt import NotNow
from fieldcam.session.viewing import WalkView
from fieldcam.store.queries.blocks import trees
from fieldcam.store.queries.walks import OPEN_STATES, ClusterState
from fieldcam.store.rows.judgements import Skip
from fieldcam.store.rows.walk import Event, EventKind


def skip(view: WalkView) -> str:
    """And on to the next cluster that needs a picture."""
    tag_id = standing(view)
    view.store.append(Skip(view.visit, tag_id))
    move_on(view, tag_id)
    return f"Tag {tag_id} skipped."


def go_to(view: WalkView, tag_id: int) -> str:
    """Whatever its state; refused where the route does not have it."""
    stop = view.route().stop(tag_id)
    if stop is None:
        raise NotNow(f"Tag {tag_id} is not on this route.")
    stand_at(view, tag_id)
    done = ", which is done already" if stop.state is ClusterState.ACCEPTED else ""
    return f"At tag {tag_id}{done}."


def step(view: WalkView, by: int) -> str:
    """From the last one to the first, and back."""
    tags = [stop.tag_id for stop in view.route().stops]
    if not tags:
        raise NotNow("This block has no clusters yet.")
    here = view.standing()
    if here not in tags:
        return go_to(view, tags[0 if by > 0 else -1])
    return go_to(view, tags[(tags.index(here) + by) % len(tags)])


def next_tree(view: WalkView) -> str:
    """Past the last one a new tree is made, once the one that is walked has a cluster."""
    tree = tree_after(view)
    route = view.route()
    stops = [stop for stop in route.stops if stop.tree == tree]
    due = [stop for stop in stops if stop.state in OPEN_STATES]
    tag_id = next((stop.tag_id for stop in due or stops), None)
    view.store.append(Event(EventKind.WENT_TO, view.visit, tag_id=tag_id, tree=tree))
    label = trees(view.store.database, route.block)[tree]
    return f"Tree {label}." if stops else f"Tree {label}: each tag you take joins the route."
