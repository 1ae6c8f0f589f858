"""A route that nobody planned: the first picture of a tag adds it to the tree that is walked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from live_walks import Walked, read
from made_readings import encoded
from stored_walks import MadeWalk, small_store

from fieldcam.session.commands import Accept, CorrectTag, GoTo, NextTree, Retake, Shoot, UndoLast
from fieldcam.session.doubt import Instead
from fieldcam.session.events import Done, Doubted, Refused, VerdictReady
from fieldcam.session.state import WalkState
from fieldcam.store.rows.orchard import Cluster, Route
from fieldcam.values import ClusterReading, ReasonCode, Status

RETAKE = Status.RETAKE


class BareWalk(MadeWalk):
    """A block of which nothing is known but its name."""

    tags = ()


@pytest.fixture
def walk(tmp_path: Path) -> Iterator[Walked]:
    with small_store(tmp_path) as store:
        made = BareWalk(store)
        found = Walked(made, made.visit())
        yield found
        found.live.close()


def places(state: WalkState) -> list[tuple[str, int]]:
    return [(stop.tree_label, stop.tag_id) for stop in state.route.stops]


def take(walk: Walked, tag_id: int) -> WalkState:
    """A picture that shows this tag, accepted."""
    walk.shoot(read(tag_id))
    return walk.after(Accept(), Done)[1]


def test_each_new_tag_joins_the_tree_that_is_walked(walk: Walked) -> None:
    state = walk.start()
    assert (state.tag_id, state.learning, state.route.stops) == (None, True, ())
    take(walk, 5)
    take(walk, 3)
    done, state = walk.after(NextTree(), Done)
    assert (done.sentence, state.tree) == ("Tree 2: each tag you take joins the route.", "2")
    refused, _ = walk.after(NextTree(), Refused)
    assert refused.sentence == "Tree 2 has no cluster yet."
    state = take(walk, 8)
    assert places(state) == [("1", 5), ("1", 3), ("2", 8)]
    assert (state.tag_id, state.learning, state.tree) == (None, True, "2")


def test_tags_of_unknown_trees_have_no_next_tree(walk: Walked) -> None:
    walk.store.append(Cluster(walk.made.block, 5), Cluster(walk.made.block, 6))
    before = walk.start()
    refused, state = walk.after(NextTree(), Refused)
    sentence = "Nothing says which tree these tags hang in."
    assert refused == Refused(sentence, Instead.GIVE_TREES)
    assert (state.tag_id, state.route) == (before.tag_id, before.route)


def test_a_new_tag_shows_its_verdict_and_is_decided_on_like_any_other(walk: Walked) -> None:
    walk.start()
    state = walk.shoot()
    assert state.tag_id is None and state.shown is not None
    refused, _ = walk.after(Accept(), Refused)
    sentence = "Which tag this picture shows is not known yet."
    assert refused == Refused(sentence, Instead.SAY_TAG_OR_RETAKE)
    walk.analysis.waiting[0].set_result(encoded(read(7)))
    assert walk.heard.next(VerdictReady).tag_id == 7
    done, state = walk.after(Accept(), Done)
    assert done.sentence == "Tag 7 accepted."


def test_a_late_reading_joins_the_tree_where_it_was_taken(walk: Walked) -> None:
    walk.start()
    take(walk, 5)
    walk.shoot()
    walk.after(NextTree(), Done)
    walk.analysis.waiting[0].set_result(encoded(read(6)))
    walk.heard.next(VerdictReady)
    _, state = walk.after(GoTo(6), Done)
    assert places(state) == [("1", 5), ("1", 6)]


def test_a_tree_that_is_gone_back_to_keeps_its_tags_together(walk: Walked) -> None:
    walk.start()
    take(walk, 5)
    walk.after(NextTree(), Done)
    take(walk, 8)
    walk.after(GoTo(5), Done)
    take_all_the_same(walk, read(6, status=RETAKE, code=ReasonCode.WRONG_TAG))
    walk.analysis.outcomes.append(read(6))
    _, state = walk.after(CorrectTag(6), VerdictReady)
    assert places(state) == [("1", 5), ("1", 6), ("2", 8)]


def test_a_picture_without_a_tag_is_taken_again_or_told_its_tag(walk: Walked) -> None:
    walk.start()
    no_tag = read(5, status=RETAKE, code=ReasonCode.NO_TAG)
    walk.shoot(untagged(no_tag))
    state = walk.shoot(untagged(no_tag))
    assert state.shown is not None and state.shown.record.retake_of is not None
    done, state = walk.after(Retake(), Done)
    assert (done.sentence, state.tag_id) == ("Take it again.", None)
    walk.analysis.outcomes.append(read(9))
    _, state = walk.after(CorrectTag(9), VerdictReady)
    assert (state.tag_id, places(state)) == (9, [("1", 9)])
    refused, _ = walk.after(CorrectTag(587), Refused)
    assert refused.sentence == "There is no tag 587: they end at 586."


def test_a_tag_that_was_taken_already_is_said(walk: Walked) -> None:
    walk.start()
    take(walk, 5)
    state = walk.shoot(read(5))
    assert (state.tag_id, state.warnings) == (5, ("Tag 5 was taken already on this visit.",))
    assert places(state) == [("1", 5)]


def test_a_tag_beside_a_planned_route_is_asked_about(walk: Walked) -> None:
    take_planned(walk)
    doubt, _ = walk.after(CorrectTag(40), Doubted)
    assert doubt.sentence.startswith("Tag 40 is not on this route.")
    walk.analysis.outcomes.append(read(40))
    _, state = walk.after(doubt.insist, VerdictReady)
    assert [tag for _, tag in places(state)] == [5, 40, 6]
    _, state = walk.after(UndoLast(), Done)
    assert [tag for _, tag in places(state)] == [5, 6]


def take_planned(walk: Walked) -> None:
    """Tag 5 of tree 1 was asked for, tag 40 was read; tag 6 hangs in tree 2."""
    walk.start()
    take(walk, 5)
    walk.after(NextTree(), Done)
    take(walk, 6)
    walk.store.append(Route(walk.made.block, (5, 6)))
    walk.after(GoTo(5), Done)
    take_all_the_same(walk, read(40, status=RETAKE, code=ReasonCode.WRONG_TAG))


def take_all_the_same(walk: Walked, reading: ClusterReading) -> None:
    """Another picture where the operator stands before a cluster that is done."""
    doubt, _ = walk.after(Shoot(), Doubted)
    walk.analysis.outcomes.append(reading)
    walk.after(doubt.insist, VerdictReady)


def test_a_learned_route_is_walked_again_in_its_order(walk: Walked) -> None:
    walk.start()
    for tag_id in (5, 3):
        take(walk, tag_id)
    walk.after(NextTree(), Done)
    take(walk, 8)
    walk.live.close()
    walk.visit = walk.made.visit(2)
    state = walk.start()
    assert (state.tag_id, state.next_tag) == (5, 3)
    done, state = walk.after(NextTree(), Done)
    assert (done.sentence, state.tag_id) == ("Tree 2.", 8)


def untagged(reading: ClusterReading) -> ClusterReading:
    return replace(reading, tag=None)
