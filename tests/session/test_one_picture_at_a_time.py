"""What was fired belongs to the cluster where it was fired, however keys follow each other."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path

import pytest
from live_walks import ToldCamera, Walked, read, walked
from stored_walks import FIRST_DAY

from fieldcam.camera.port import FlashStereoDevice
from fieldcam.session.commands import (
    Accept,
    AnswerQuestion,
    Command,
    CorrectTag,
    GoTo,
    NextTree,
    OtherTarget,
    Retake,
    SecondView,
    Shoot,
    SkipCluster,
    Step,
    Strike,
)
from fieldcam.session.events import Changed, DayDoubted, Done, Refused, Saved, VerdictReady
from fieldcam.session.set_up.today import AnotherDay
from fieldcam.session.state import CameraState, WalkState
from fieldcam.store.queries.blocks import tree_of_tags
from fieldcam.store.queries.history import CaptureRecord, visit_captures
from fieldcam.store.queries.walks import ClusterState
from fieldcam.store.rows.judgements import Answer
from fieldcam.store.rows.orchard import Block
from fieldcam.values import RawPair

BUSY = "A picture is being taken: wait until it is saved."


class SlowCamera(ToldCamera):
    """Says when an exposure has begun, and ends it when it is let."""

    def __init__(self) -> None:
        super().__init__()
        self.begun, self.go_on = threading.Event(), threading.Event()
        self.go_on.set()

    def capture(self, deadline_s: float) -> RawPair:
        self.begun.set()
        assert self.go_on.wait(10)
        return super().capture(deadline_s)


class LateCamera(ToldCamera):
    """Takes a while to be opened."""

    def __init__(self) -> None:
        super().__init__()
        self.asked, self.go_on = threading.Event(), threading.Event()

    def open(self) -> FlashStereoDevice:
        self.asked.set()
        assert self.go_on.wait(10)
        return super().open()


@pytest.fixture
def walk(tmp_path: Path) -> Iterator[Walked]:
    with walked(tmp_path) as found:
        found.camera = SlowCamera()
        yield found


@contextmanager
def exposing(walk: Walked) -> Iterator[None]:
    """While a picture is being taken where the operator stands."""
    camera = walk.camera
    assert isinstance(camera, SlowCamera)
    camera.begun.clear()
    camera.go_on.clear()
    walk.live.do(Shoot())
    assert camera.begun.wait(10)
    walk.heard.until(lambda state: state.camera is CameraState.EXPOSING)
    yield
    camera.go_on.set()


def taken(walk: Walked) -> list[CaptureRecord]:
    return list(visit_captures(walk.store.database, walk.visit))


def saved(walk: Walked) -> WalkState:
    walk.heard.next(Saved)
    return walk.heard.next(Changed).state


def test_presses_do_not_queue(walk: Walked) -> None:
    """Space three times at tag 11, Enter twice: one picture, which nothing undoes."""
    walk.start()
    with exposing(walk):
        for press in (Shoot(), Shoot(), walk.camera.press, SecondView()):
            assert walk.after(press, Refused)[0].sentence == BUSY
        walk.analysis.outcomes.append(read(11))
    walk.heard.next(VerdictReady)
    walk.after(Accept(), Done)
    refused, state = walk.after(Accept(), Refused)
    assert refused.sentence == "There is no picture of this cluster yet."
    assert (state.tag_id, [record.tag_id for record in taken(walk)]) == (12, [11])
    stop = state.route.stop(11)
    assert stop is not None and stop.state is ClusterState.ACCEPTED


DECISIONS: dict[str, Command] = {
    "accept": Accept(),
    "retake": Retake(),
    "fallen": AnswerQuestion(Answer.FALLEN),
    "hidden": AnswerQuestion(Answer.HIDDEN),
    "target": OtherTarget(),
    "strike": Strike(0),
    "tag": CorrectTag(12),
}


@pytest.mark.parametrize("name", DECISIONS)
def test_nothing_is_decided_while_the_picture_is_taken_anew(walk: Walked, name: str) -> None:
    walk.start()
    walk.shoot(read(11))
    with exposing(walk):
        refused, _ = walk.after(DECISIONS[name], Refused)
        assert refused.sentence == "A picture is being taken here: decide when it is shown."
    state = saved(walk)
    assert state.tag_id == 11 and all(record.action is None for record in taken(walk))


MOVES: dict[str, Command] = {
    "next": Step(1),
    "far": GoTo(12),
    "skip": SkipCluster(),
}


@pytest.mark.parametrize("name", MOVES)
def test_a_picture_that_comes_late_takes_nobody_back(walk: Walked, name: str) -> None:
    walk.start()
    with exposing(walk):
        done, _ = walk.after(MOVES[name], Done)
        assert "not taken" not in done.sentence
    state = saved(walk)
    assert state.tag_id == 12
    assert [record.tag_expected for record in taken(walk)] == [11]
    with exposing(walk):
        pass
    saved(walk)
    assert [record.tag_expected for record in taken(walk)] == [11, 12]


def test_whoever_comes_back_finds_the_picture(walk: Walked) -> None:
    walk.start()
    with exposing(walk):
        walk.after(Step(1), Done)
        walk.after(Step(-1), Done)
    state = saved(walk)
    assert state.tag_id == 11 and state.shown is not None


@pytest.mark.parametrize("name", MOVES)
def test_moving_on_drops_what_waits(tmp_path: Path, name: str) -> None:
    with walked(tmp_path) as walk:
        camera = walk.camera = LateCamera()
        walk.start()
        assert camera.asked.wait(10)
        walk.live.do(Shoot())
        walk.heard.until(lambda state: state.camera is CameraState.EXPOSING)
        done, state = walk.after(MOVES[name], Done)
        assert done.sentence.endswith("The picture of tag 11 that waited was not taken.")
        assert state.camera is not CameraState.EXPOSING
        camera.go_on.set()
        walk.heard.until(lambda state: state.camera is CameraState.READY)
        walk.after(Shoot(), Saved)
        assert [record.tag_expected for record in taken(walk)] == [12]


def test_a_new_tag_joins_the_tree_where_it_was_fired(tmp_path: Path) -> None:
    """Not the one that the operator has reached when it is saved."""
    with walked(tmp_path) as walk:
        block = walk.store.block(Block("South"))
        walk.visit = walk.store.visit(block, FIRST_DAY)
        walk.camera = SlowCamera()
        walk.start()
        walk.shoot(read(5))
        walk.after(Accept(), Done)
        with exposing(walk):
            done, _ = walk.after(NextTree(), Done)
            assert done.sentence.startswith("Tree 2")
            walk.analysis.outcomes.append(read(6))
        walk.heard.next(VerdictReady)
        walk.heard.next(Changed)
        assert tree_of_tags(walk.store.database, block) == {5: "1", 6: "1"}
        walk.shoot(read(7))
        assert tree_of_tags(walk.store.database, block)[7] == "2"


def test_a_picture_of_another_day_waits_for_an_answer(walk: Walked) -> None:
    """The camera's own button is no way around it."""
    day = AnotherDay(FIRST_DAY, FIRST_DAY + timedelta(days=1))
    asked = [day, day, None]
    walk.start(another_day=lambda: asked.pop(0))
    for press in (Shoot(), lambda: walk.camera.press()):
        doubt, _ = walk.after(press, DayDoubted)
        assert doubt.day == day
    assert taken(walk) == []
    walk.after(Shoot(), Saved)
