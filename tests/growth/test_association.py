"""Fruitlets are followed from picture to picture by where they hang, not by their size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_clusters import Pose, Sphere, made_view, made_visit, ring
from paper_association import associate
from scipy.spatial.transform import Rotation

from fieldcam.growth.association.geometry import match_by_geometry
from fieldcam.growth.association.joining import join
from fieldcam.growth.association.likelihood import Plausibility
from fieldcam.growth.association.paper import match_by_paper
from fieldcam.growth.association.points import points_of
from fieldcam.growth.association.poses import turn_vectors
from fieldcam.growth.association.size_order import match_by_size_order
from fieldcam.growth.places import Association, ClusterVisit, MatchWord, Place, Track
from fieldcam.growth.records import Presence
from fieldcam.growth.size_rule import SizeRule
from fieldcam.growth.tracking import track

GROWN = 0.9
"""mm of growth over the two days between the made visits."""
SMALL = (0.15, -0.1, 0.1)
LARGE = (0.4, -0.35, 0.3)


def later(spheres: Sequence[Sphere], spread: float = 1.09) -> list[Sphere]:
    """The same fruitlets, grown and moved apart."""
    return [
        Sphere(s.id, s.center_mm * spread, None if s.diameter_mm is None else s.diameter_mm + GROWN)
        for s in spheres
    ]


def followed(tracks: Sequence[Track]) -> list[tuple[int, ...]]:
    """Ids of each track's fruitlets, picture by picture."""
    return [tuple(p.fruitlet for v in t.visits.values() for p in v.places) for t in tracks]


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), SMALL, LARGE])
@pytest.mark.parametrize("tagged", [True, False])
def test_grown_cluster_is_recognised_however_it_turned(
    turn: tuple[float, float, float], tagged: bool
) -> None:
    before = made_view("a", ring(), Pose(tagged=tagged))
    after = made_view("b", later(ring()), Pose(turn, (9.0, -6.0, 425.0), tagged=tagged))
    tracks = track([made_visit(0, before), made_visit(2, after)])
    assert sorted(followed(tracks)) == [(k, k) for k in range(6)]


def test_confidence_is_high_where_places_are_far_apart_and_low_for_twins() -> None:
    twins = [Sphere(0, np.array([0.0, 4.2, 0]), 8.0), Sphere(1, np.array([0.0, -4.2, 0]), 8.0)]
    swapped = (0.0, 0.0, np.pi / 2)
    unsure = match_by_geometry(
        points_of(made_view("a", twins)), points_of(made_view("b", twins, Pose(swapped))), 2.0
    )
    sure = match_by_geometry(
        points_of(made_view("a", ring())), points_of(made_view("b", later(ring()))), 2.0
    )
    assert np.diag(sure).min() > 0.95
    assert 0.2 < unsure[0, 0] < 0.8


def test_certainties_of_a_fruitlet_never_sum_to_more_than_one() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        views = [
            made_view(name, [Sphere(k, rng.normal(0, 14, 3), 8.0) for k in range(5)])
            for name in "ab"
        ]
        certainty = match_by_geometry(points_of(views[0]), points_of(views[1]), 2.0)
        assert certainty.min() >= 0
        assert certainty.sum(axis=0).max() <= 1 + 1e-9
        assert certainty.sum(axis=1).max() <= 1 + 1e-9


def test_newcomer_far_from_all_stays_unmatched() -> None:
    stranger = Sphere(9, np.array([-48.0, 40.0, 20.0]), 8.0)
    tracks = track(
        [
            made_visit(0, made_view("a", ring())),
            made_visit(2, made_view("b", [*later(ring()), stranger])),
        ]
    )
    assert (9,) in followed(tracks)


def test_size_that_no_fruitlet_grows_to_in_two_days_is_not_matched() -> None:
    alone = [Sphere(0, np.zeros(3), 6.0)]
    huge = [Sphere(0, np.zeros(3), 16.0)]
    tracks = track([made_visit(0, made_view("a", alone)), made_visit(2, made_view("b", huge))])
    assert followed(tracks) == [(0,), (0,)]


@pytest.mark.parametrize(
    ("grown_mm", "sd_mm", "one"),
    [(1.0, None, True), (-0.5, None, True), (-5.0, None, False), (-5.0, 2.5, True)],
)
def test_a_fruitlet_does_not_shrink_by_more_than_its_errors(
    grown_mm: float, sd_mm: float | None, one: bool
) -> None:
    """At a place that would do for either."""
    views = [
        made_view(name, [Sphere(0, np.zeros(3), size, sd_mm)], Pose(tagged=True))
        for name, size in (("a", 12.0), ("b", 12.0 + grown_mm))
    ]
    tracks = track([made_visit(0, views[0]), made_visit(4, views[1])])
    assert followed(tracks) == ([(0, 0)] if one else [(0,), (0,)])


@given(
    days=st.integers(0, 10),
    sizes=st.lists(st.none() | st.floats(3.0, 25.0), min_size=1, max_size=5),
    sd_mm=st.none() | st.floats(0.01, 3.0),
)
def test_the_odds_of_sizes_are_those_of_growth_that_is_never_negative(
    days: int, sizes: list[float | None], sd_mm: float | None
) -> None:
    """Against the integral over all growth, in steps; an unknown size says nothing."""
    first, second = (
        points_of(made_view(name, [replace(s, sd_mm=sd_mm) for s in ring(sizes)])) for name in "ab"
    )
    p = Plausibility()
    error_mm = np.sqrt(2) * max(p.size_sd_mm, sd_mm or 0.0)
    grown = np.linspace(0.0, 30.0, 6001) if days else np.zeros(1)
    prior = np.ones(1)
    if days:
        rate = (grown / days - p.rate_mm_per_day) / p.rate_sd_mm_per_day
        prior = np.exp(-(rate**2) / 2)
        prior[0] /= 2
        prior /= prior.sum()
    odds = p.size_log_odds(first, second, float(days))
    for (i, j), found in np.ndenumerate(odds):
        if (one := sizes[i]) is None or (other := sizes[j]) is None:
            assert found == 0.0
            continue
        errors = np.exp(-(((other - one - grown) / error_mm) ** 2) / 2) / error_mm
        likely = float((prior * errors).sum() / np.sqrt(2 * np.pi))
        if likely > 1e-200:
            assert found == pytest.approx(np.log(likely * p.size_range_mm), abs=0.01)


def test_two_views_of_a_day_give_one_fruitlet_with_the_larger_size() -> None:
    first = made_view("a", ring())
    second = made_view("b", [replace(s, diameter_mm=(s.diameter_mm or 0) + 0.2) for s in ring()])
    tracks = track([made_visit(0, first, second)])
    assert [len(t.visits) for t in tracks] == [1] * 6
    sizes = [next(iter(t.visits.values())).sighting.diameter_mm for t in tracks]
    assert sizes == pytest.approx([9.2, 8.7, 8.2, 7.7, 7.2, 6.7])


@pytest.mark.parametrize(
    ("method", "rule", "sds_mm", "counts"),
    [
        (Association.GEOMETRY, None, (0.1, 0.2), 0),
        (Association.GEOMETRY, None, (0.2, 0.1), 1),
        (Association.GEOMETRY, None, (0.1, None), 0),
        (Association.GEOMETRY, None, (None, 0.4), 1),
        (Association.GEOMETRY, None, (None, None), 1),
        (Association.GEOMETRY, SizeRule.LARGER, (0.1, 0.2), 1),
        (Association.PAPER, None, (0.1, 0.2), 1),
        (Association.PAPER, SizeRule.BETTER_KNOWN, (0.1, 0.2), 0),
    ],
)
def test_of_two_views_the_better_known_size_counts(
    method: Association,
    rule: SizeRule | None,
    sds_mm: tuple[float | None, float | None],
    counts: int,
) -> None:
    """The second view's is the larger; of unknown errors that one counts, as in the paper."""
    views = [
        made_view(name, [replace(s, diameter_mm=size, sd_mm=sd) for s in ring([8.0])])
        for name, size, sd in zip("ab", (8.0, 8.2), sds_mm, strict=True)
    ]
    (found,) = track([made_visit(0, *views)], method, size_rule=rule)
    seen = found.visits[made_visit(0).day].sighting
    assert (seen.diameter_mm, seen.sd_mm) == ((8.0, 8.2)[counts], sds_mm[counts])


def test_fruitlets_are_numbered_from_the_largest_of_the_first_visit() -> None:
    tracks = track([made_visit(0, made_view("a", ring()))])
    assert [t.number for t in tracks] == [1, 2, 3, 4, 5, 6]
    assert [f[0] for f in followed(tracks)] == [0, 3, 1, 2, 5, 4]


def test_fruitlet_without_a_size_is_followed_by_its_place() -> None:
    sizes = [9.0, None, 7.5, 8.5, 6.5, 7.0]
    tracks = track(
        [
            made_visit(0, made_view("a", ring(sizes))),
            made_visit(2, made_view("b", later(ring(sizes)))),
        ]
    )
    assert sorted(followed(tracks)) == [(k, k) for k in range(6)]
    seen = next(t for t in tracks if followed([t]) == [(1, 1)])
    assert {v.sighting.presence for v in seen.visits.values()} == {Presence.SEEN}


def test_three_visits_agree_although_the_middle_one_misses_a_fruitlet() -> None:
    visits = [
        made_visit(0, made_view("a", ring())),
        made_visit(2, made_view("b", [s for s in later(ring()) if s.id != 2], Pose(SMALL))),
        made_visit(4, made_view("c", later(later(ring())), Pose(LARGE))),
    ]
    tracks = track(visits)
    assert (2, 2) in followed(tracks)
    gap = next(t for t in tracks if followed([t]) == [(2, 2)])
    assert gap.visits[visits[1].day].sighting.presence is Presence.NOT_SEEN


@pytest.mark.parametrize("method", list(Association))
@pytest.mark.parametrize("counts", [(0, 3), (3, 0), (0, 0), (1, 1)])
def test_empty_pictures_are_no_trouble(method: Association, counts: tuple[int, int]) -> None:
    views = [made_view(name, ring()[:n]) for name, n in zip("ab", counts, strict=True)]
    tracks = track([made_visit(0, views[0]), made_visit(2, views[1])], method)
    assert sum(len(f) for f in followed(tracks)) == sum(counts)


def test_no_visits_give_no_tracks() -> None:
    assert track([]) == ()
    assert track([ClusterVisit(made_visit(0).day, ())]) == ()


class TestOperatorsWord:
    def test_joins_what_geometry_keeps_apart(self) -> None:
        visits = [
            made_visit(0, made_view("a", [Sphere(0, np.zeros(3), 6.0)])),
            made_visit(2, made_view("b", [Sphere(0, np.zeros(3), 16.0)])),
        ]
        word = MatchWord(Place("b", 0), Place("a", 0))
        tracks = track(visits, words=[word])
        assert followed(tracks) == [(0, 0)]
        assert tracks[0].visits[visits[1].day].by_hand

    def test_exchanges_two_partners(self) -> None:
        visits = [
            made_visit(0, made_view("a", ring())),
            made_visit(2, made_view("b", later(ring()))),
        ]
        words = [MatchWord(Place("b", 0), Place("a", 1)), MatchWord(Place("b", 1), Place("a", 0))]
        assert {(0, 1), (1, 0), (2, 2)} <= set(followed(track(visits, words=words)))

    def test_parts_what_geometry_joins(self) -> None:
        visits = [
            made_visit(0, made_view("a", ring())),
            made_visit(2, made_view("b", later(ring()))),
        ]
        found = followed(track(visits, words=[MatchWord(Place("b", 3), None, "a")]))
        assert found.count((3,)) == 2

    def test_about_a_picture_that_is_gone_changes_nothing(self) -> None:
        visits = [
            made_visit(0, made_view("a", ring())),
            made_visit(2, made_view("b", later(ring()))),
        ]
        gone = [MatchWord(Place("x", 3), None, "a"), MatchWord(Place("b", 3), Place("y", 1))]
        assert followed(track(visits, words=gone)) == followed(track(visits))


def test_struck_out_and_corrected_fruitlets_are_left_out() -> None:
    view = replace(made_view("a", ring()), struck_out=frozenset({4}))
    assert len(track([made_visit(0, view)])) == 5
    assert track([made_visit(0, replace(view, cluster=7))]) == ()


def test_own_paper_recipe_agrees_with_the_plain_one() -> None:
    rng = np.random.default_rng(8)
    same = total = 0
    for _ in range(30):
        spheres = [Sphere(k, rng.normal(0, 12, 3), 8.0) for k in range(int(rng.integers(3, 7)))]
        moved = [replace(s, center_mm=s.center_mm + rng.normal(0, 2.5, 3)) for s in spheres]
        views = made_view("a", spheres), made_view("b", moved, Pose(tuple(rng.normal(0, 0.2, 3))))
        clouds = [{f.id: f.cloud_mm.astype(np.float64) for f in v.reading.fruitlets} for v in views]
        plain = set(associate(*clouds))
        own = match_by_paper(points_of(views[0]), points_of(views[1]))
        same += len(plain & {(int(i), int(j)) for i, j in zip(*np.nonzero(own), strict=True)})
        total += len(plain)
    assert same / total > 0.97


def test_size_order_pairs_the_largest_with_the_largest() -> None:
    first = points_of(made_view("a", ring([9.0, None, 7.0, 8.0])))
    second = points_of(made_view("b", ring([7.5, 8.0, 9.5])))
    certainty = match_by_size_order(first, second)
    assert set(zip(*np.nonzero(certainty), strict=True)) == {(0, 2), (3, 1), (2, 0)}


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 5), min_size=1, max_size=5), st.randoms(use_true_random=False))
def test_joined_groups_hold_every_sighting_once_and_no_picture_twice(
    counts: list[int], random: st.DataObject
) -> None:
    rng = np.random.default_rng(random.getrandbits(32))  # type: ignore[attr-defined]
    odds = {
        (i, j): rng.normal(0, 3, (counts[i], counts[j]))
        for j in range(len(counts))
        for i in range(j)
    }
    groups = join(counts, odds)
    picture = np.repeat(np.arange(len(counts)), counts)
    assert sorted(k for g in groups for k in g) == list(range(sum(counts)))
    assert all(len({int(picture[k]) for k in g}) == len(g) for g in groups)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=1, max_size=5),
    st.sampled_from([0.0, 1e-12, 1e-3, 1.0, 3.0, np.pi - 1e-6, np.pi]),
)
def test_turns_are_those_of_scipy(axes: list[tuple[float, float, float]], angle_rad: float) -> None:
    axis = np.array(axes)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    turned = Rotation.from_rotvec(angle_rad * axis / np.maximum(length, 1e-3)).as_matrix()
    again = Rotation.from_rotvec(turn_vectors(turned)).as_matrix()
    np.testing.assert_allclose(again, turned, atol=1e-7)
