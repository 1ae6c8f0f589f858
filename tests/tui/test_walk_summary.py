"""At the end of a walk it is said what it came to, and what to do next."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from made_states import AIM
from screens import LARGE, SMALL, walk_text
from stored_walks import MadeWalk, small_store

from fieldcam.session.summary import WalkSummary
from fieldcam.session.viewing import WalkView
from fieldcam.store.queries.walks import ClusterState
from fieldcam.store.rows.judgements import Action, Decision, FruitletMark, MarkKind, Skip
from fieldcam.tui.text.telling import all_done, summed_up, what_next

SUMMARY = WalkSummary(8, 1, 2, 3, 1, (9, 10), True)


def test_the_store_is_summed_up_once_nothing_is_due(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        first, visit = made.visit(), made.visit(2)
        made.accept(first, 11)
        view = WalkView(store, visit)
        assert view.state().summary is None
        again = made.take(visit, 11).key
        store.append(Decision(again, Action.RETAKE))
        made.accept(visit, 11)
        made.accept(visit, 12)
        unread = made.take(visit, 21).key
        store.append(
            Decision(unread, Action.ACCEPT),
            Skip(visit, 22),
            FruitletMark.on_cluster(MarkKind.FALLEN, visit, 11, 2),
            FruitletMark.on_cluster(MarkKind.HIDDEN, visit, 12),
            FruitletMark.on_cluster(MarkKind.FALLEN, first, 12),
        )
        assert view.state().summary == WalkSummary(3, 1, 1, 2, 1, (21,), True)


def test_the_sentence_names_all() -> None:
    assert summed_up(SUMMARY) == (
        "Taken 8, retaken 1, skipped 2; missing: 3 fallen, 1 hidden; doubtful: tags 9, 10."
    )
    assert summed_up(replace(SUMMARY, doubtful=())).endswith("doubtful: none.")
    assert "how many will stay" in what_next(SUMMARY)
    assert "again in some days" in what_next(replace(SUMMARY, visited_before=False))


@pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])
@pytest.mark.parametrize("state", [ClusterState.ACCEPTED, ClusterState.SKIPPED])
def test_the_walk_screen_shows_it_whole(size: tuple[int, int], state: ClusterState) -> None:
    stops = tuple(replace(stop, state=state) for stop in AIM.route.stops)
    route = replace(AIM.route, stops=stops)
    ended = replace(AIM, tag_id=None, next_tag=None, progress=None, route=route, summary=SUMMARY)
    said = " ".join(walk_text(size, ended).split())
    assert all_done(ended).sentence in said
