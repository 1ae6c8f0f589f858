"""Decisions on the picture that is shown."""

from __future__ import annotations

from fieldcam.session.deciding.here import (
    check_tag,
    missing_here,
    move_on,
    shown_here,
    stand_at,
    standing,
)
from fieldcam.session.deciding.learning import new_cluster
from fieldcam.session.doubt import Doubtful, Instead, NotNow
from fieldcam.session.state import Stage
from fieldcam.session.viewing import WalkView
from fieldcam.store.queries.walks import ClusterState
from fieldcam.store.rows.judgements import (
    Action,
    Decision,
    FruitletMark,
    MarkKind,
    Note,
    TagCorrection,
    TargetCorrection,
)
from fieldcam.values import HIGHEST_TAG_ID, Status


def accept(view: WalkView, insist: bool) -> str:
    """Refused while its tag, or a question about missing fruitlets, is open."""
    tag_id, shown = standing(view), shown_here(view)
    if shown.record.action is Action.ACCEPT:
        raise NotNow("This picture is accepted already.")
    check_tag(shown)
    if missing_here(view, shown):
        raise NotNow("Fewer fruitlets than last visit.", Instead.ANSWER_OR_RETAKE)
    if not insist and shown.status is Status.RETAKE:
        raise Doubtful("The verdict is RETAKE. Keep this picture all the same?")
    if not insist and shown.stage is not Stage.READ:
        raise Doubtful("There is no verdict on this picture. Keep it all the same?")
    view.store.append(Decision(shown.id, Action.ACCEPT))
    move_on(view, tag_id)
    return f"Tag {tag_id} accepted."


def retake(view: WalkView) -> str:
    """Whatever was decided before."""
    view.store.append(Decision(shown_here(view).id, Action.RETAKE))
    tag_id = view.standing()
    return "Take it again." if tag_id is None else f"Tag {tag_id}: take it again."


def correct_tag(view: WalkView, tag_id: int, insist: bool) -> str:
    """A tag that the route does not have joins it; doubtful where the route was planned."""
    shown, route = shown_here(view), view.route()
    if tag_id > HIGHEST_TAG_ID:
        raise NotNow(f"There is no tag {tag_id}: they end at {HIGHEST_TAG_ID}.")
    stop = route.stop(tag_id)
    done = stop is not None and stop.state is ClusterState.ACCEPTED
    if not insist and done and shown.record.tag_id != tag_id:
        raise Doubtful(f"Tag {tag_id} is done already. Is this another picture of it?")
    if not insist and stop is None and route.planned:
        raise Doubtful(f"Tag {tag_id} is not on this route. Does it hang in this tree?")
    new = (new_cluster(view, shown.id, tag_id),) if stop is None else ()
    view.store.append(TagCorrection(shown.id, tag_id), *new)
    stand_at(view, tag_id)
    return f"The picture is of tag {tag_id}."


def other_target(view: WalkView) -> str:
    """They take turns in the order of their numbers."""
    shown = shown_here(view)
    if shown.reading is None or shown.record.reading is None:
        raise NotNow("There is no reading to choose a cluster in.")
    found = sorted({f.cluster for f in shown.reading.fruitlets if f.cluster is not None})
    if len(found) < 2:
        raise NotNow("Only one cluster was found in this picture.")
    ids = {fruitlet.id for fruitlet in shown.target}
    now = next((f.cluster for f in shown.reading.fruitlets if f.id in ids), None)
    chosen = found[(found.index(now) + 1) % len(found)] if now in found else found[0]
    view.store.append(TargetCorrection(shown.record.reading.id, chosen))
    return f"Target is cluster {found.index(chosen) + 1} of {len(found)}."


def strike(view: WalkView, fruitlet: int) -> str:
    """One of the target's, of the last reading."""
    shown = shown_here(view)
    seen = next((s for s in shown.target if s.id == fruitlet), None)
    if shown.record.reading is None or seen is None:
        raise NotNow("Choose a fruitlet of the list first.")
    if not seen.living:
        gone = "marked fallen" if MarkKind.FALLEN in seen.marks else "struck out"
        raise NotNow(f"Already {gone}.")
    reading = shown.record.reading.id
    view.store.append(FruitletMark.on_fruitlet(MarkKind.NOT_A_FRUITLET, reading, fruitlet))
    return "Struck out: no fruitlet."


def write_note(view: WalkView, text: str) -> str:
    """About the picture that is shown, else about the visit."""
    if not text.strip():
        raise NotNow("The note is empty.")
    shown = view.shown(view.standing(), view.route())
    view.store.append(Note(text.strip(), view.visit if shown is None else shown.id))
    return "Noted."
