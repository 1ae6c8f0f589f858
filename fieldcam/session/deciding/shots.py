"""Which picture is to be taken next."""

from __future__ import annotations

from fieldcam.session.deciding.here import learning, nothing_due, shown_here, standing
from fieldcam.session.doubt import Doubtful
from fieldcam.session.shutter import Shot
from fieldcam.session.state import Shown, Stage
from fieldcam.session.viewing import WalkView
from fieldcam.store.queries.walks import ClusterState
from fieldcam.store.rows.row import EntryId
from fieldcam.values import Expectation


def due_shot(view: WalkView, insist: bool = False) -> Shot:
    """The picture that is due here; raises Doubtful where none is."""
    (tag_id, tree), route = view.place(), view.route()
    shown = view.shown(tag_id, route)
    if tag_id is None:
        return _shot_of_any_tag(view, shown, tree, insist)
    stop = route.stop(tag_id)
    if stop is not None and stop.state is ClusterState.ACCEPTED and not insist:
        raise Doubtful(f"Tag {tag_id} is done already. Take it again?")
    expected = view.expectation(tag_id)
    if shown is None:
        return Shot(expected, tree=tree)
    return Shot(expected, shown.record.view, retake_of=shown.id, tree=tree)


def second_shot(view: WalkView) -> Shot:
    """A picture of the same cluster from another side, beside the last one."""
    shown, tag_id = shown_here(view), standing(view)
    expected, (_, tree) = view.expectation(tag_id), view.place()
    return Shot(expected, shown.record.view + 1, tree=tree)


def _shot_of_any_tag(
    view: WalkView, shown: Shown | None, tree: EntryId | None, insist: bool
) -> Shot:
    """Which cluster it is will be read; it takes the place of a picture that shows no tag."""
    if not insist and not learning(view):
        raise Doubtful(f"{nothing_due(view)} Take one that the route does not have?")
    again = shown is not None and shown.stage is not Stage.ANALYSING
    replaced = shown.id if shown is not None and again else None
    return Shot(Expectation(), retake_of=replaced, tree=tree)
