"""The live walk: pictures first, decisions as rows, trouble that costs nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic

import pytest
from live_walks import ToldCamera, Walked, read, walked
from made_readings import encoded

from fieldcam.analysis.status import AnalysisState, AnalysisStatus
from fieldcam.camera.port import FlashStereoDevice
from fieldcam.errors import (
    AnalysisFailed,
    AnalysisOff,
    AnalysisTimeout,
    FlashMissing,
    StorageFull,
)
from fieldcam.growth.places import Place
from fieldcam.session.commands import (
    Accept,
    AcceptPicture,
    AddByHand,
    AnswerQuestion,
    Command,
    CorrectTag,
    CrownKing,
    GoTo,
    OtherTarget,
    RestartAnalysis,
    Retake,
    SecondView,
    Shoot,
    SkipCluster,
    Step,
    Strike,
    TellMissing,
    UndoLast,
    WriteNote,
)
from fieldcam.session.deciding.missing import MAX_FRUITLETS
from fieldcam.session.doubt import Instead
from fieldcam.session.events import (
    AnalysisTrouble,
    CameraTrouble,
    Changed,
    Done,
    Doubted,
    Refused,
    Saved,
    StorageTrouble,
    VerdictReady,
)
from fieldcam.session.state import CameraState, Stage, WalkState
from fieldcam.store.connection import rows
from fieldcam.store.queries.counted import counted_visits
from fieldcam.store.queries.history import cluster_history, visit_captures
from fieldcam.store.queries.walks import ClusterState, expectation
from fieldcam.store.rows.judgements import Action, Answer, MarkKind
from fieldcam.store.rows.orchard import Route
from fieldcam.store.rows.row import EntryId
from fieldcam.values import Expectation, RawPair, ReasonCode
from fieldcam.values import Status as VerdictStatus

RETAKE, CONFIRM = VerdictStatus.RETAKE, VerdictStatus.CONFIRM


@pytest.fixture
def walk(tmp_path: Path) -> Iterator[Walked]:
    with walked(tmp_path) as found:
        yield found


@pytest.fixture
def later(tmp_path: Path) -> Iterator[Walked]:
    """Two days after a visit on which tag 11 was accepted with five fruitlets."""
    with walked(tmp_path, days_later=2) as found:
        found.made.accept(found.made.visit(), 11)
        yield found


def state_of(walk: Walked, tag_id: int) -> ClusterState:
    stop = walk.live._view.route().stop(tag_id)
    assert stop is not None
    return stop.state


def test_a_walk_begins_at_the_first_cluster(walk: Walked) -> None:
    state = walk.start()
    assert (state.tag_id, state.next_tag, state.shown) == (11, 12, None)
    assert state.progress is not None
    assert (state.progress.tree, state.progress.trees, state.progress.clusters) == (1, 2, 2)


class SpoiltOnce(ToldCamera):
    """Its first picture is dark."""

    def capture(self, deadline_s: float) -> RawPair:
        if self.taken == 0:
            self.taken += 1
            raise FlashMissing("The flash did not fire.", "Wait until it is charged.")
        return super().capture(deadline_s)


def test_a_spoilt_picture_leaves_the_camera_open(tmp_path: Path) -> None:
    with walked(tmp_path) as walk:
        walk.camera = SpoiltOnce()
        walk.start()
        trouble, state = walk.after(Shoot(), CameraTrouble)
        assert trouble.error.message == "The flash did not fire."
        assert state.camera is CameraState.READY
        walk.after(Shoot(), Saved)
        assert (walk.camera.opened, walk.camera.closed) == (1, 0)


def test_a_picture_is_saved_then_read_then_accepted(walk: Walked) -> None:
    walk.start()
    state = walk.shoot()
    assert state.shown is not None
    assert (state.shown.stage, state.waiting) == (Stage.ANALYSING, 1)
    walk.analysis.waiting[0].set_result(encoded(read(11)))
    verdict = walk.heard.next(VerdictReady)
    state = walk.heard.next(Changed).state
    assert (verdict.tag_id, state.waiting) == (11, 0)
    assert state.shown is not None and state.shown.living == 5
    done, state = walk.after(Accept(), Done)
    assert done.sentence == "Tag 11 accepted."
    assert (state.tag_id, state.shown) == (12, None)


def test_ten_captures_do_not_wait_for_the_analysis(
    walk: Walked, note: Callable[[str], None]
) -> None:
    walk.start()
    began = monotonic()
    for _ in range(10):
        walk.after(Shoot(), Saved)
    note(f"ten captures were saved in {monotonic() - began:.2f} s, none analysed")
    assert len(visit_captures(walk.store.database, walk.visit)) == 10


def test_a_newer_picture_takes_the_place_of_the_last_one(walk: Walked) -> None:
    walk.start()
    first = walk.shoot(read(11)).shown
    second = walk.shoot(read(11)).shown
    assert first is not None and second is not None
    assert (second.record.retake_of, second.record.view) == (first.id, 1)


def test_an_unplugged_camera_is_said_and_opened_again(walk: Walked) -> None:
    walk.start()
    walk.camera.plugged = False
    trouble, state = walk.after(Shoot(), CameraTrouble)
    assert trouble.error.hint == "Plug it in."
    assert state.camera is CameraState.LOST
    walk.camera.plugged = True
    assert walk.shoot().camera is CameraState.READY
    assert walk.camera.opened == 2


def test_a_lost_camera_is_said_before_it_is_given_back(walk: Walked) -> None:
    walk.start()
    walk.camera.plugged = False
    with walk.camera.held():
        _, state = walk.after(Shoot(), CameraTrouble)
        assert (state.camera, walk.camera.closed) == (CameraState.LOST, 0)


def test_a_walk_begins_without_a_camera(walk: Walked) -> None:
    walk.camera.plugged = False
    if walk.start().camera is not CameraState.LOST:
        walk.heard.until(lambda state: state.camera is CameraState.LOST)
    assert any(isinstance(event, CameraTrouble) for event in walk.heard.events)


def test_a_full_disk_is_found_out_before_the_flash(
    walk: Walked, monkeypatch: pytest.MonkeyPatch
) -> None:
    walk.start()

    def full() -> None:
        raise StorageFull("Only 3 MB are free.")

    with monkeypatch.context() as patch:
        patch.setattr(walk.store.space, "check", full)
        trouble, _ = walk.after(Shoot(), StorageTrouble)
    assert "3 MB" in trouble.error.message
    assert walk.camera.taken == 0
    assert walk.shoot().shown is not None


def test_a_failed_analysis_keeps_the_picture(walk: Walked) -> None:
    walk.start()
    walk.analysis.outcomes.append(AnalysisFailed("The analysis ended in the middle."))
    trouble, state = walk.after(Shoot(), AnalysisTrouble)
    assert trouble.error.message == "The analysis ended in the middle."
    assert state.shown is not None
    assert (state.shown.stage, state.shown.failure) == (Stage.FAILED, trouble.error.message)
    assert (state.waiting, state.failed) == (0, 1)
    doubt, _ = walk.after(Accept(), Doubted)
    _, state = walk.after(doubt.insist, Done)
    assert state.tag_id == 12


def test_a_picture_that_was_not_read_in_time_has_a_second_try(walk: Walked) -> None:
    walk.start()
    late = AnalysisTimeout("The analysis did not answer.")
    state = walk.shoot(late)
    assert (state.waiting, state.failed) == (1, 0)
    walk.analysis.waiting[0].set_exception(late)
    trouble = walk.heard.next(AnalysisTrouble)
    assert trouble.error is late
    state = walk.heard.next(Changed).state
    assert (state.waiting, state.failed, len(walk.analysis.asked)) == (0, 1, 2)


def test_pictures_wait_for_an_analysis_that_is_off(walk: Walked) -> None:
    walk.start()
    walk.analysis.status = AnalysisStatus(AnalysisState.STOPPED)
    walk.analysis.outcomes.append(AnalysisOff("The analysis is off."))
    state = walk.shoot()
    assert (state.waiting, state.analysis.state) == (1, AnalysisState.STOPPED)
    walk.analysis.outcomes.append(read(11))
    _, state = walk.after(RestartAnalysis(), VerdictReady)
    assert state.waiting == 0


def test_a_failed_picture_that_is_read_again_is_told_as_such(walk: Walked) -> None:
    """By R on the Device screen; a second failure is one again."""
    walk.start()
    failed = AnalysisFailed("The analysis crashed.")
    walk.analysis.outcomes.append(failed)
    _, state = walk.after(Shoot(), AnalysisTrouble)
    assert state.shown is not None and state.shown.stage is Stage.FAILED
    _, state = walk.after(RestartAnalysis(), Done)
    assert state.shown is not None and state.shown.stage is Stage.ANALYSING
    walk.analysis.waiting[-1].set_exception(failed)
    walk.heard.next(AnalysisTrouble)
    state = walk.heard.next(Changed).state
    assert state.shown is not None and state.shown.stage is Stage.FAILED


def test_what_an_earlier_day_left_unread_is_read(later: Walked) -> None:
    left = later.made.take(later.made.visit(), 12)
    later.analysis.outcomes.append(read(12))
    later.start()
    assert later.analysis.asked == [(left, Expectation(12))]


def test_a_walk_resumes_where_it_stopped(walk: Walked) -> None:
    walk.start()
    walk.shoot(read(11))
    walk.after(Accept(), Done)
    walk.shoot()
    walk.live.close()
    walk.analysis.asked.clear()
    walk.analysis.outcomes.append(read(12))
    state = walk.start()
    assert state.tag_id == 12 and state.shown is not None
    assert [asked for _, asked in walk.analysis.asked] == [Expectation(12)]
    if state.waiting:
        state = walk.heard.until(lambda state: state.waiting == 0)
    assert state.shown is not None and state.shown.stage is Stage.READ


def test_fewer_fruitlets_ask_one_question(later: Walked) -> None:
    assert later.start().before == 5
    state = later.shoot(read(11, fruitlets=3, status=CONFIRM, code=ReasonCode.FEWER_THAN_BEFORE))
    assert state.missing == 2
    refused, _ = later.after(Accept(), Refused)
    assert refused == Refused("Fewer fruitlets than last visit.", Instead.ANSWER_OR_RETAKE)
    done, state = later.after(AnswerQuestion(Answer.HIDDEN), Done)
    assert done.sentence == "Tag 11 accepted, 2 hidden."
    assert state.tag_id == 12
    undone, state = later.after(UndoLast(), Done)
    assert undone.sentence == "Undone: the decision and the mark on tag 11."
    assert (state.tag_id, state.missing) == (11, 2)


def test_an_answer_that_bounces_marks_nothing_on_the_next_cluster(later: Walked) -> None:
    later.start()
    later.shoot(read(11, fruitlets=3, status=CONFIRM, code=ReasonCode.FEWER_THAN_BEFORE))
    later.after(AnswerQuestion(Answer.FALLEN), Done)
    for bounce in (AnswerQuestion(Answer.FALLEN), AnswerQuestion(Answer.HIDDEN)):
        refused, state = later.after(bounce, Refused)
        assert refused.sentence == "There is no picture of this cluster yet."
        assert (state.tag_id, state.marks) == (12, ())


def test_what_a_picture_shows_is_neither_fallen_nor_hidden(later: Walked) -> None:
    later.start()
    before = later.shoot(read(11, fruitlets=5))
    for command in (AnswerQuestion(Answer.FALLEN), AnswerQuestion(Answer.HIDDEN)):
        refused, state = later.after(command, Refused)
        assert refused == Refused("No fruitlet is missing.", Instead.MARK_UNSEEN)
        assert told(state) == told(before)
        assert state.shown is not None and state.shown.living == 5


def test_on_a_first_visit_nothing_has_fallen(walk: Walked) -> None:
    walk.start()
    walk.shoot(read(11, 3))
    refused, state = walk.after(AnswerQuestion(Answer.FALLEN), Refused)
    assert "No earlier visit is known" in refused.sentence and state.marks == ()


def test_each_missing_fruitlet_has_an_answer_of_its_own(later: Walked) -> None:
    later.start()
    state = later.shoot(read(11, fruitlets=3, status=CONFIRM, code=ReasonCode.FEWER_THAN_BEFORE))
    assert state.shown is not None
    capture, earlier = state.shown.id, earlier_reading(later)

    def tell(fruitlet: int, answer: Answer) -> TellMissing:
        return TellMissing(capture, Place(earlier, fruitlet), answer)

    done, state = later.after(tell(3, Answer.FALLEN), Done)
    assert done.sentence == "Told: fallen. 1 fruitlet left to tell."
    assert (state.tag_id, state.missing, state.told) == (11, 2, 1)
    refused, _ = later.after(tell(3, Answer.HIDDEN), Refused)
    assert refused == Refused("That was told already.", Instead.UNDO_ANSWER)
    done, state = later.after(tell(4, Answer.HIDDEN), Done)
    assert done.sentence == "Tag 11 accepted: all that is missing is told."
    assert state.tag_id == 12
    refused, _ = later.after(tell(2, Answer.HIDDEN), Refused)
    assert refused == Refused("This picture is decided on already.", Instead.UNDO_DECISION)
    (*_, visit) = counted_visits(later.store.database, state.route.block, 11)
    assert (visit.fallen, visit.hidden) == (1, 1)
    assert [(word.fruitlet, word.answer) for word in visit.told] == [
        (3, Answer.FALLEN),
        (4, Answer.HIDDEN),
    ]
    undone, state = later.after(UndoLast(), Done)
    assert undone.sentence == "Undone: the decision and the answer and the mark on tag 11."
    assert (state.tag_id, state.missing, state.told) == (11, 2, 1)
    assert expectation(later.store.database, later.made.visit(9), 11).fruitlets == 5


def test_a_missing_fruitlet_without_a_place_is_told_too(later: Walked) -> None:
    later.start()
    state = later.shoot(read(11, fruitlets=4, status=CONFIRM, code=ReasonCode.FEWER_THAN_BEFORE))
    assert state.shown is not None
    capture = state.shown.id
    done, state = later.after(TellMissing(capture, None, Answer.HIDDEN), Done)
    assert done.sentence == "Tag 11 accepted: all that is missing is told."
    (*_, visit) = counted_visits(later.store.database, state.route.block, 11)
    assert (visit.hidden, visit.told) == (1, ())


def test_pictures_of_earlier_visits_are_decided_on(later: Walked) -> None:
    """As an import leaves them: the walk stands elsewhere, on another day."""
    made, block = later.made, later.made.block
    visit = made.visit(1)
    fewer, whole = made.take(visit, 11).key, made.take(visit, 12).key
    made.read(fewer, 11, 4)
    made.read(whole, 12, 5)
    later.start()
    refused, _ = later.after(AcceptPicture(fewer), Refused)
    assert refused == Refused("1 fruitlet missing.", Instead.COMPARE_DAYS)
    place = Place(earlier_reading(later), 4)
    later.after(TellMissing(fewer, place, Answer.FALLEN), Done)
    done, state = later.after(AcceptPicture(whole), Done)
    assert (done.sentence, state.tag_id) == ("Tag 12 accepted.", 11)
    history = cluster_history(later.store.database, block, 12)
    assert history[-1].action is Action.ACCEPT
    (_, told) = counted_visits(later.store.database, block, 11)
    assert (told.fallen, [word.fruitlet for word in told.told]) == (1, [4])


def earlier_reading(walk: Walked) -> EntryId:
    block = walk.made.block
    first, *_ = cluster_history(walk.store.database, block, 11)
    assert first.reading is not None
    return first.reading.id


def test_a_fruitlet_is_struck_out_once(walk: Walked) -> None:
    walk.start()
    walk.shoot(read(11, 3))
    walk.after(Strike(1), Done)
    refused, state = walk.after(Strike(1), Refused)
    assert refused.sentence == "Already struck out."
    assert state.shown is not None and state.shown.living == 2


def test_no_more_are_fallen_or_hidden_than_there_were(later: Walked) -> None:
    assert later.start().before == 5
    later.shoot()
    for _ in range(5):
        later.after(AnswerQuestion(Answer.HIDDEN), Done)
    refused, state = later.after(AnswerQuestion(Answer.HIDDEN), Refused)
    assert refused.sentence == "No more: 5 of the 5 last visit are seen or marked already."
    assert [mark.count for mark in state.marks] == [1] * 5


def test_a_cluster_that_nobody_counted_has_a_bound_too(walk: Walked) -> None:
    walk.start()
    walk.shoot()
    for _ in range(MAX_FRUITLETS):
        walk.live.do(AnswerQuestion(Answer.HIDDEN))
    assert "of a cluster" in walk.after(AnswerQuestion(Answer.HIDDEN), Refused)[0].sentence


def test_the_same_fruitlets_are_not_counted_twice(later: Walked) -> None:
    """The next visit expects those that are hidden, once."""
    fewer = read(11, fruitlets=3, status=CONFIRM, code=ReasonCode.FEWER_THAN_BEFORE)
    later.start()
    later.shoot()
    later.after(AnswerQuestion(Answer.HIDDEN), Done)
    later.shoot(fewer)
    done, _ = later.after(AnswerQuestion(Answer.HIDDEN), Done)
    assert done.sentence == "Tag 11 accepted, 2 hidden (1 of them marked before)."
    later.after(GoTo(11), Done)
    later.after(Retake(), Done)
    later.shoot(fewer)
    done, _ = later.after(AnswerQuestion(Answer.HIDDEN), Done)
    assert done.sentence == "Tag 11 accepted, 2 hidden (2 of them marked before)."
    assert expectation(later.store.database, later.made.visit(9), 11).fruitlets == 5


def test_a_wrong_tag_is_said_and_not_accepted(walk: Walked) -> None:
    walk.start()
    state = walk.shoot(read(12, status=RETAKE, code=ReasonCode.WRONG_TAG))
    assert state.shown is not None and state.shown.wrong_tag == 12
    refused, _ = walk.after(Accept(), Refused)
    assert refused == Refused("Tag 12 was read, 11 is due.", Instead.RETAKE_OR_SAY_TAG)
    walk.analysis.outcomes.append(read(12))
    _, state = walk.after(CorrectTag(12), VerdictReady)
    assert walk.analysis.asked[-1][1] == Expectation(12)
    assert (state.tag_id, state.shown is not None) == (12, True)
    walk.after(Accept(), Done)
    assert (state_of(walk, 11), state_of(walk, 12)) == (ClusterState.TODO, ClusterState.ACCEPTED)


def test_the_operators_word_on_a_misread_tag_counts(walk: Walked) -> None:
    walk.start()
    walk.shoot(read(99, status=RETAKE, code=ReasonCode.WRONG_TAG))
    walk.analysis.outcomes.append(read(99))
    _, state = walk.after(CorrectTag(11), VerdictReady)
    # Were 11 expected, the tag that is read would be called wrong for ever.
    assert walk.analysis.asked[-1][1].tag_id == 99
    assert (state.tag_id, state.warnings) == (11, ())
    done, _ = walk.after(Accept(), Done)
    assert done.sentence == "Tag 11 accepted."


def test_a_tag_that_is_done_is_said(walk: Walked) -> None:
    walk.start()
    walk.shoot(read(11))
    walk.after(Accept(), Done)
    state = walk.shoot(read(11, status=RETAKE, code=ReasonCode.WRONG_TAG))
    assert state.warnings == ("Tag 11 is done already.",)
    doubt, _ = walk.after(CorrectTag(11), Doubted)
    assert doubt.sentence.startswith("Tag 11 is done already")
    done, _ = walk.after(GoTo(11), Done)
    assert done.sentence == "At tag 11, which is done already."
    doubt, _ = walk.after(Shoot(), Doubted)
    walk.after(doubt.insist, Saved)


def test_a_verdict_of_retake_is_kept_only_when_insisted_on(walk: Walked) -> None:
    walk.start()
    walk.shoot(read(11, status=RETAKE, code=ReasonCode.BLURRED))
    doubt, _ = walk.after(Accept(), Doubted)
    _, state = walk.after(doubt.insist, Done)
    assert state.tag_id == 12


def test_a_second_view_stands_beside_the_first(walk: Walked) -> None:
    walk.start()
    refused, _ = walk.after(SecondView(), Refused)
    assert refused.sentence == "There is no picture of this cluster yet."
    walk.shoot(read(11))
    _, state = walk.after(SecondView(), Saved)
    assert state.shown is not None
    assert (state.shown.record.view, state.shown.record.retake_of) == (2, None)


DECISIONS: dict[str, tuple[Command, str]] = {
    "accept": (Accept(), "the decision"),
    "retake": (Retake(), "the decision"),
    "hidden": (AnswerQuestion(Answer.HIDDEN), "the mark"),
    "strike": (Strike(0), "the mark"),
    "target": (OtherTarget(), "the choice of the target"),
    "note": (WriteNote("a leaf"), "the note"),
    "skip": (SkipCluster(), "the skipping"),
}


@pytest.mark.parametrize("name", DECISIONS)
def test_every_decision_can_be_undone(walk: Walked, name: str) -> None:
    walk.start()
    before = walk.shoot(read(11))
    command, named = DECISIONS[name]
    _, after = walk.after(command, Done)
    assert told(after) != told(before)
    done, undone = walk.after(UndoLast(), Done)
    assert done.sentence == f"Undone: {named} on tag 11."
    assert told(undone) == told(before)
    refused, _ = walk.after(UndoLast(), Refused)
    assert refused.sentence == "There is nothing to undo."


def test_marks_of_the_history_can_be_undone(walk: Walked) -> None:
    walk.start()
    before = walk.shoot(read(11, 3))
    assert before.shown is not None and before.shown.record.reading is not None
    capture = before.shown.id
    _, crowned = walk.after(CrownKing(capture, 1), Done)
    _, added = walk.after(AddByHand(capture, 9.5), Done)
    assert crowned.shown is not None and added.shown is not None
    assert [f.marks for f in crowned.shown.target] == [(), (MarkKind.KING,), ()]
    assert (crowned.shown.living, added.shown.living) == (3, 4)
    for _ in range(2):
        done, state = walk.after(UndoLast(), Done)
        assert done.sentence == "Undone: the mark on tag 11."
    assert told(state) == told(before)


def test_marks_that_make_no_sense_are_refused(walk: Walked) -> None:
    walk.start()
    state = walk.shoot(read(11, 3))
    assert state.shown is not None
    capture = state.shown.id
    commands: list[Command] = [
        CrownKing(capture, 4),
        CrownKing("no picture", 0),
        AddByHand(capture, 0.0),
        AddByHand(capture, float("nan")),
        AddByHand("no picture", 9.0),
    ]
    for command in commands:
        _, after = walk.after(command, Refused)
        assert told(after) == told(state)


def told(state: WalkState) -> tuple[object, ...]:
    shown = state.shown
    if shown is None:
        return (state.tag_id, state.route)
    return (state.tag_id, state.route, shown.record, state.marks)


def test_a_correction_of_the_tag_can_be_undone(walk: Walked) -> None:
    walk.start()
    walk.shoot(read(12, status=RETAKE, code=ReasonCode.WRONG_TAG))
    walk.analysis.outcomes.append(read(12))
    walk.after(CorrectTag(12), VerdictReady)
    done, state = walk.after(UndoLast(), Done)
    assert done.sentence == "Undone: the tag's correction on tag 11."
    assert (state.tag_id, state.shown is not None) == (11, True)


def test_undoing_adds_rows_and_removes_none(walk: Walked) -> None:
    walk.start()
    walk.shoot(read(11))
    walk.after(Accept(), Done)
    walk.after(UndoLast(), Done)
    kinds = [row["kind"] for row in rows(walk.store.database, "SELECT kind FROM entry")]
    assert kinds.count("decision") == kinds.count("undo") == 1


def test_stepping_goes_round_the_route(walk: Walked) -> None:
    walk.start()
    _, state = walk.after(Step(-1), Done)
    assert state.tag_id == 22
    _, state = walk.after(Step(1), Done)
    assert state.tag_id == 11


def test_when_all_is_done_it_is_said(walk: Walked) -> None:
    walk.store.append(Route(walk.made.block, walk.made.tags))
    walk.start()
    for _ in range(3):
        walk.after(SkipCluster(), Done)
    _, state = walk.after(SkipCluster(), Done)
    assert (state.tag_id, state.next_tag) == (None, None)
    refused, _ = walk.after(Accept(), Refused)
    assert refused.sentence.startswith("Skipped: tags 11, 12, 21, 22.")
    doubt, _ = walk.after(Shoot(), Doubted)
    assert doubt.sentence == (
        "Skipped: tags 11, 12, 21, 22. Take one that the route does not have?"
    )
    assert walk.camera.taken == 0


def test_all_clusters_are_done_where_all_were_accepted(walk: Walked) -> None:
    walk.store.append(Route(walk.made.block, walk.made.tags))
    for tag_id in walk.made.tags:
        walk.made.accept(walk.visit, tag_id)
    assert walk.start().tag_id is None
    doubt, _ = walk.after(Shoot(), Doubted)
    assert doubt.sentence.startswith("All clusters are done.")
    assert walk.camera.taken == 0


def test_a_camera_that_goes_while_it_is_opened_is_given_back(
    walk: Walked, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = walk.camera.open

    def open_and_lose() -> FlashStereoDevice:
        camera = opened()
        walk.camera.plugged = False
        return camera

    monkeypatch.setattr(walk.camera, "open", open_and_lose)
    walk.start()
    walk.live.close()
    assert (walk.camera.opened, walk.camera.closed) == (1, 1)
