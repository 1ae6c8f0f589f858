"""Fruitlets that the last visit had and a picture does not show: fallen, or hidden."""

from __future__ import annotations

from fieldcam.growth.places import Place
from fieldcam.session.commands import TellMissing
from fieldcam.session.deciding.here import (
    check_tag,
    missing_here,
    move_on,
    shown_here,
    standing,
)
from fieldcam.session.doubt import Instead, NotNow
from fieldcam.session.state import Shown, missing
from fieldcam.session.viewing import WalkView, expected_at
from fieldcam.store.queries.counted import missing_words
from fieldcam.store.queries.history import CaptureRecord, capture_record
from fieldcam.store.rows.fruit import MissingWord
from fieldcam.store.rows.judgements import Action, Answer, Decision, FruitletMark, MarkKind
from fieldcam.store.rows.row import EntryId, Row
from fieldcam.values import Status
from fieldcam.words import number_of

MAX_FRUITLETS = 20
"""No cluster carries more."""
MARKS = {Answer.FALLEN: MarkKind.FALLEN, Answer.HIDDEN: MarkKind.HIDDEN}


def answer_question(view: WalkView, answer: Answer) -> str:
    """With CONFIRM's question the picture counts, else one fruitlet is marked."""
    tag_id, shown = standing(view), shown_here(view)
    if fewer := missing_here(view, shown):
        return _answered(view, answer, tag_id, shown, fewer)
    _check_room(view, answer, tag_id, shown)
    view.store.append(FruitletMark.on_cluster(MARKS[answer], view.visit, tag_id))
    return f"One fruitlet of tag {tag_id} marked {answer}."


def tell_missing(view: WalkView, told: TellMissing) -> str:
    """Counts as one of the fruitlets that are missing, with a mark of its own."""
    record, visit, tag_id = _open_question(view, told.capture)
    place, mark = told.place, MARKS[told.answer]
    words = missing_words(view.store.database, visit, tag_id)
    if place in {Place(word.reading, word.fruitlet) for word in words}:
        raise NotNow("That was told already.", Instead.UNDO_ANSWER)
    marks = view.marks(tag_id, visit)
    left = _left_to_tell(view, record, visit, tag_id) - 1
    if left < 0:
        raise NotNow("No fruitlet is missing.", Instead.MARK_UNSEEN)
    rows: list[Row] = [FruitletMark.on_cluster(mark, visit, tag_id)]
    if place is not None:
        rows.insert(0, MissingWord(visit, tag_id, place.reading, place.fruitlet, told.answer))
    if left:
        view.store.append(*rows)
        return f"Told: {told.answer}. {number_of(left, 'fruitlet')} left to tell."
    alike = all(each.mark is mark for each in marks)
    _accept(view, record.id, visit, tag_id, told.answer if alike else None, rows)
    return f"Tag {tag_id} accepted: all that is missing is told."


def accept_picture(view: WalkView, capture: EntryId) -> str:
    """Where nothing is left to tell of it."""
    record, visit, tag_id = _open_question(view, capture)
    if record.reading is None or record.reading.status is Status.RETAKE:
        raise NotNow("There are no sizes to accept: the verdict is RETAKE, or there is none.")
    if left := _left_to_tell(view, record, visit, tag_id):
        raise NotNow(f"{number_of(left, 'fruitlet')} missing.", Instead.COMPARE_DAYS)
    _accept(view, capture, visit, tag_id)
    return f"Tag {tag_id} accepted."


def _accept(
    view: WalkView,
    capture: EntryId,
    visit: EntryId,
    tag_id: int,
    answer: Answer | None = None,
    rows: list[Row] | None = None,
) -> None:
    view.store.append(Decision(capture, Action.ACCEPT, answer), *(rows or ()))
    if visit == view.visit:
        move_on(view, tag_id)


def _open_question(view: WalkView, capture: EntryId) -> tuple[CaptureRecord, EntryId, int]:
    """A picture that is not decided on, its visit and its tag."""
    record = capture_record(view.store.database, capture)
    if record is None or record.visit is None or record.tag_id is None:
        raise NotNow("Which cluster this picture shows is not known yet.")
    if record.action is not None:
        raise NotNow("This picture is decided on already.", Instead.UNDO_DECISION)
    return record, record.visit, record.tag_id


def _left_to_tell(view: WalkView, record: CaptureRecord, visit: EntryId, tag_id: int) -> int:
    """How many of its missing fruitlets wait for an answer."""
    before = expected_at(view.store.database, visit, tag_id).fruitlets
    told = sum(mark.count for mark in view.marks(tag_id, visit))
    return max(0, missing(record, before) - told)


def _answered(view: WalkView, answer: Answer, tag_id: int, shown: Shown, fewer: int) -> str:
    """The picture counts, and so many fruitlets as were not marked before."""
    check_tag(shown)
    before = min(fewer, _marked(view, tag_id))
    rows: list[Row] = []
    if fewer > before:
        # Last, so that an undo after a restart takes it back first.
        rows.append(FruitletMark.on_cluster(MARKS[answer], view.visit, tag_id, fewer - before))
    _accept(view, shown.id, view.visit, tag_id, answer, rows)
    known = f" ({before} of them marked before)" if before else ""
    return f"Tag {tag_id} accepted, {fewer} {answer}{known}."


def _marked(view: WalkView, tag_id: int) -> int:
    """Fruitlets of this cluster that were said to be fallen or hidden today."""
    return sum(mark.count for mark in view.marks(tag_id))


def _check_room(view: WalkView, answer: Answer, tag_id: int, shown: Shown) -> None:
    """No more are fallen or hidden than the cluster had; what a picture shows is neither."""
    before, marked = view.expectation(tag_id).fruitlets, _marked(view, tag_id)
    if before is None and answer is Answer.FALLEN:
        raise NotNow("No earlier visit is known here: nothing can have fallen since.")
    known = marked + (shown.living or 0)
    if known < (MAX_FRUITLETS if before is None else before):
        return
    if marked:
        had = f"of the {before} last visit" if before is not None else "of a cluster"
        raise NotNow(f"No more: {known} {had} are seen or marked already.")
    raise NotNow("No fruitlet is missing.", Instead.MARK_UNSEEN)
