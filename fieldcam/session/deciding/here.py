"""Where the operator stands and what is shown there, or why a command finds nothing."""

from __future__ import annotations

from fieldcam.session.doubt import Instead, NotNow
from fieldcam.session.left_over import left_over
from fieldcam.session.state import Shown, missing
from fieldcam.session.viewing import WalkView, is_learning
from fieldcam.store.queries.history import CaptureRecord, ReadingSummary, capture_record
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import Event, EventKind


def standing(view: WalkView) -> int:
    """The tag where the operator stands; raises NotNow where there is none."""
    tag_id = view.standing()
    if tag_id is not None:
        return tag_id
    if view.shown(None, view.route()) is not None:
        sentence = "Which tag this picture shows is not known yet."
        raise NotNow(sentence, Instead.SAY_TAG_OR_RETAKE)
    if learning(view):
        raise NotNow("Take a picture first: its tag joins the route.")
    raise NotNow(f"{nothing_due(view)} Choose one on the route to go back to it.")


def shown_here(view: WalkView) -> Shown:
    """The last picture there; raises NotNow where there is none."""
    shown = view.shown(view.standing(), view.route())
    if shown is None:
        raise NotNow("There is no picture of this cluster yet.")
    return shown


def read_picture(view: WalkView, capture: EntryId) -> tuple[CaptureRecord, ReadingSummary]:
    """A picture of any visit; raises NotNow where it has no reading."""
    record = capture_record(view.store.database, capture)
    if record is None or record.reading is None:
        raise NotNow("This picture has no reading.")
    return record, record.reading


def missing_here(view: WalkView, shown: Shown) -> int:
    """How many fruitlets fewer the picture shows than the last visit had."""
    return missing(shown.record, view.expectation(standing(view)).fruitlets)


def check_tag(shown: Shown) -> None:
    """Raise NotNow where the picture shows another tag than the one that is due."""
    read, due = shown.wrong_tag, shown.record.tag_id
    if read is not None:
        raise NotNow(f"Tag {read} was read, {due} is due.", Instead.RETAKE_OR_SAY_TAG)


def learning(view: WalkView) -> bool:
    """Whether new tags join the route here."""
    return is_learning(view.route(), view.place()[1])


def nothing_due(view: WalkView) -> str:
    """Why no cluster is due here."""
    return left_over(view.route()) or "All clusters are done."


def move_on(view: WalkView, tag_id: int) -> None:
    """To the next cluster that needs a picture, unless the rows say so already."""
    if view.standing() == tag_id:
        stand_at(view, view.route().next_tag(tag_id))


def stand_at(view: WalkView, tag_id: int | None) -> None:
    """Turn to another tag, which is a row where it is news."""
    if view.standing() != tag_id:
        view.store.append(Event(EventKind.WENT_TO, view.visit, tag_id=tag_id))
