"""Algorithm 1: which fruitlets belong together, and which of them to the tag."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldcam.vision.clustering import (
    PAPER_CLUSTERS,
    ClusterParameters,
    clusters,
    rejoined,
    target_cluster,
    with_singles,
)

Vectors = npt.NDArray[np.float64]
PARAMETERS = ClusterParameters()


def at(*points: tuple[float, float, float]) -> Vectors:
    return np.array(points, dtype=np.float64).reshape(-1, 3)


def bunch(rng: np.random.Generator, center: tuple[float, float, float], count: int) -> Vectors:
    return np.array(center) + rng.uniform(-14, 14, (count, 3))


CASES = {
    "none": (at(), ()),
    "one": (at((0, 0, 0)), ()),
    "two near": (at((0, 0, 0), (20, 0, 0)), ((0, 1),)),
    "exactly tau1 apart, so tau2 joins them": (at((0, 0, 0), (36, 0, 0)), ((0, 1),)),
    "exactly tau2 apart": (at((0, 0, 0), (50, 0, 0)), ()),
    "a zero-length edge of weight 1": (at((5, 5, 5), (5, 5, 5)), ((0, 1),)),
    "two groups": (
        at((0, 0, 0), (20, 0, 0), (10, 15, 0), (200, 0, 0), (220, 0, 0), (210, 15, 0)),
        ((0, 1, 2), (3, 4, 5)),
    ),
    "a pair joins its nearest community": (
        at((0, 0, 0), (15, 0, 0), (0, 15, 0), (55, 0, 0), (60, 5, 0)),
        ((0, 1, 2, 3, 4),),
    ),
    "two pairs too far apart to merge": (
        at((0, 0, 0), (10, 0, 0), (130, 0, 0), (140, 0, 0)),
        ((0, 1), (2, 3)),
    ),
    "a single joins within d_u": (
        at((0, 0, 0), (15, 0, 0), (0, 15, 0), (46, 20, 0)),
        ((0, 1, 2, 3),),
    ),
    "a single beyond d_u stays alone": (
        at((0, 0, 0), (15, 0, 0), (0, 15, 0), (72, 0, 0)),
        ((0, 1, 2),),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_known_arrangements(case: str) -> None:
    points, expected = CASES[case]
    assert clusters(points) == expected


def test_two_visible_fruitlets_of_a_neighbour_join_only_by_the_papers_limit() -> None:
    tagged = at((0, 0, 0), (20, 0, 0), (10, 18, 0))
    points = np.concatenate([tagged, at((62, 0, 0), (66, 25, 0))])
    assert clusters(points) == ((0, 1, 2), (3, 4))
    assert clusters(points, PAPER_CLUSTERS) == ((0, 1, 2, 3, 4),)


@st.composite
def orchards(draw: st.DrawFn) -> Vectors:
    seed = draw(st.integers(0, 10_000))
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-120, 120, (draw(st.integers(1, 4)), 3))
    parts = [bunch(rng, tuple(c), int(rng.integers(1, 7))) for c in centers]
    return np.concatenate(parts)


@settings(max_examples=60, deadline=None)
@given(orchards(), st.integers(0, 1000))
def test_the_order_of_the_input_does_not_matter(points: Vectors, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(len(points))
    first = {frozenset(group) for group in clusters(points)}
    second = {frozenset(int(order[i]) for i in group) for group in clusters(points[order])}
    assert first == second


@settings(max_examples=60, deadline=None)
@given(orchards())
def test_each_fruitlet_is_in_one_community_at_most(points: Vectors) -> None:
    found = clusters(points)
    members = [i for group in found for i in group]
    assert len(members) == len(set(members))
    assert all(len(group) >= 2 for group in found)
    assert set(members) <= set(range(len(points)))
    everyone = [i for group in with_singles(found, range(len(points))) for i in group]
    assert sorted(everyone) == list(range(len(points)))


@settings(max_examples=30, deadline=None)
@given(orchards())
def test_no_fruitlet_that_could_join_a_community_is_left_over(points: Vectors) -> None:
    found = clusters(points)
    for single in set(range(len(points))) - {i for group in found for i in group}:
        for group in found:
            joint = points[[*group, single]]
            farthest = np.linalg.norm(joint - joint.mean(axis=0), axis=1).max()
            assert farthest >= PARAMETERS.single_mm


def test_separate_bunches_are_told_apart() -> None:
    rng = np.random.default_rng(2)
    points = np.concatenate([bunch(rng, (110.0 * k, 0, 430), 5) for k in range(4)])
    assert clusters(points) == tuple(tuple(range(5 * k, 5 * k + 5)) for k in range(4))


NEAR_TAG = at((50, 0, 0), (60, 10, 0), (55, -10, 0))
STRAGGLER = at((-48, 0, 0), (-140, 0, 0), (-150, 10, 0))


@pytest.mark.parametrize(
    ("points", "communities", "expected"),
    [
        (NEAR_TAG, ((0, 1, 2),), 0),
        (np.concatenate([STRAGGLER, NEAR_TAG]), ((0, 1, 2), (3, 4, 5)), 1),
        (NEAR_TAG + 400, ((0, 1, 2),), None),
        (NEAR_TAG, (), None),
    ],
    ids=["beside", "not a neighbour's straggler", "too far", "none"],
)
def test_the_target_is_the_community_nearest_the_tag(
    points: Vectors, communities: tuple[tuple[int, ...], ...], expected: int | None
) -> None:
    assert target_cluster(communities, points, (0.0, 0.0, 0.0)) == expected


def test_a_last_fruitlet_keeps_its_tag() -> None:
    points = np.concatenate([at((40, 0, 0)), NEAR_TAG + 95])
    found = with_singles(clusters(points), range(len(points)))
    best = target_cluster(found, points, (0.0, 0.0, 0.0))
    assert best is not None
    assert found[best] == (0,)
    doubted = with_singles(clusters(points), range(1, len(points)))
    assert all(0 not in group for group in doubted)


def test_halves_of_one_bud_are_rejoined_and_two_buds_are_not() -> None:
    bud = np.array([[-22.0, 0, 0], [-18, 8, 0], [-14, -8, 0], [14, 8, 0], [18, -8, 0], [22, 0, 0]])
    halves = ((0, 1, 2), (3, 4, 5))
    assert rejoined(halves, bud, 38.0) == ((0, 1, 2, 3, 4, 5),)
    apart = bud + (np.arange(6) >= 3)[:, None] * [45.0, 0.0, 0.0]
    assert rejoined(halves, apart, 38.0) == halves
