"""The route of a whole block is seen at once, however small the terminal is."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_states import AIM
from screens import LARGE, SMALL, Driven, drive

from fieldcam.store.queries.walks import ClusterState, Stop, WalkRoute

STATES = list(ClusterState)


def block(trees: int, clusters: int) -> WalkRoute:
    """Tags of three digits, in all states."""
    stops = tuple(
        Stop(
            500 + tree * clusters + n,
            f"tree{tree}",
            str(tree + 1),
            STATES[(tree + n) % len(STATES)],
            (),
        )
        for tree in range(trees)
        for n in range(clusters)
    )
    return replace(AIM.route, stops=stops)


@pytest.mark.parametrize(
    ("size", "clusters", "words"),
    [(SMALL, 7, False), (SMALL, 4, True), (LARGE, 7, True), (SMALL, 2, True)],
)
def test_ten_trees_are_seen_whole(size: tuple[int, int], clusters: int, words: bool) -> None:
    route = block(10, clusters)

    async def script(driven: Driven) -> None:
        await driven.tell(replace(AIM, route=route, tag_id=500, progress=None))
        await driven.press("o")
        lines = driven.text.splitlines()
        for tree in range(10):
            line = next(line for line in lines if line.split()[:1] == [str(tree + 1)])
            for stop in route.stops[tree * clusters : (tree + 1) * clusters]:
                assert str(stop.tag_id) in line
        said = {"reading", "decide", "RETAKE", "skipped"}
        assert all(word in driven.text for word in said)
        assert ("500 to do" in driven.text) is words
        assert ("ok done" in driven.text) is not words

    drive(size, script)


def test_a_state_that_becomes_longer_is_not_cut() -> None:
    first, *others = block(1, 2).stops

    async def script(driven: Driven) -> None:
        for state in (ClusterState.TODO, ClusterState.WAITING, ClusterState.SKIPPED):
            route = replace(AIM.route, stops=(replace(first, state=state), *others))
            await driven.tell(replace(AIM, route=route, tag_id=500, progress=None))
            if state is ClusterState.TODO:
                await driven.press("o")
        assert "*500 skipped" in driven.text

    drive(SMALL, script)
