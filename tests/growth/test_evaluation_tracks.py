"""Association, fates and forecasts are scored by names."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import pytest
from made_evaluation import caliper_block, caliper_fruit, day, named_cluster

from fieldcam.growth.evaluation.evaluating import aapd, score_readings, seconds_of
from fieldcam.growth.evaluation.following import (
    NO_MATCHES,
    AssociationScore,
    FateScore,
    score_association,
    score_fates,
)
from fieldcam.growth.evaluation.named import NamedCluster
from fieldcam.growth.places import Association, MatchWord, Place, Track, TrackedVisit
from fieldcam.growth.records import BlockRecord, Presence, Sighting
from fieldcam.growth.tracking import track

NAN = float("nan")
GROWN = named_cluster(17, {0: [[9.0, 8.0, 7.5, 8.5]], 4: [[12.0, 9.0, 9.5, 8.9]]})


def tracked(number: int, *visits: tuple[int, list[tuple[str, int]] | Presence]) -> Track:
    """What each day holds: (reading, fruitlet) of each picture, or what is said of it."""
    found: dict[date, TrackedVisit] = {}
    for on, what in visits:
        if isinstance(what, Presence):
            found[day(on)] = TrackedVisit(Sighting(what), ())
        else:
            places = tuple(Place(*place) for place in what)
            found[day(on)] = TrackedVisit(Sighting(Presence.SIZED, 9.0), places)
    return Track(number, found)


GONE = named_cluster(17, {0: [[9.0, 8.0, 7.5, 8.5]], 4: [[NAN, 9.0, 9.5, 8.9]]})
LOST = {
    said: tracked(1, (0, [("17/0/0", 0)]), (4, said))
    for said in (Presence.FALLEN, Presence.NOT_SEEN)
}
"""Fruit "a", of which there is nothing to be seen on day 4."""


def joined(*pairs: tuple[int, int]) -> list[Track]:
    """Fruitlets of day 0 and of day 4 that are taken for one."""
    return [
        tracked(k, (0, [("17/0/0", one)]), (4, [("17/4/0", other)]))
        for k, (one, other) in enumerate(pairs)
    ]


@pytest.mark.parametrize(
    ("pairs", "score"),
    [
        ([(0, 0), (1, 1), (2, 2), (3, 3)], AssociationScore(4, 4, 4)),
        ([(0, 0), (1, 2), (2, 1)], AssociationScore(1, 3, 4)),
        ([], AssociationScore(0, 0, 4)),
    ],
    ids=["all right", "two swapped, one lost", "none"],
)
def test_matches_are_right_when_their_names_are_equal(
    pairs: list[tuple[int, int]], score: AssociationScore
) -> None:
    assert score_association(GROWN, joined(*pairs)) == score


def test_only_fruitlets_sized_on_both_visits_could_be_matched() -> None:
    cluster = named_cluster(17, {0: [[9.0, 8.0, 7.5]], 4: [[12.0, None, NAN]]})
    assert score_association(cluster, joined((0, 0))) == AssociationScore(1, 1, 1)


def test_a_match_with_a_nameless_fruitlet_of_a_named_picture_is_wrong() -> None:
    foreign = named_cluster(17, {0: [[9.0, 8.0]], 4: [[12.0, 9.0]]}, "a?")
    assert score_association(foreign, joined((0, 1))) == AssociationScore(0, 1, 1)
    assert score_association(foreign, joined((0, 0), (1, 1))) == AssociationScore(1, 1, 1)


def test_pictures_without_any_name_judge_nothing() -> None:
    names = {place: name for place, name in GROWN.names.items() if place.reading == "17/0/0"}
    half = NamedCluster(17, GROWN.visits, names)
    assert score_association(half, joined((0, 0), (1, 2))) == NO_MATCHES


def test_a_fruitlet_that_is_two_fruits_within_a_day_is_wrong() -> None:
    cluster = named_cluster(17, {0: [[9.0, 8.0], [9.1, 8.1]], 4: [[12.0, 9.0]]})
    mixed = tracked(1, (0, [("17/0/0", 0), ("17/0/1", 1)]), (4, [("17/4/0", 0)]))
    assert score_association(cluster, [mixed]) == AssociationScore(0, 1, 2)


def test_each_visit_is_scored_against_the_next() -> None:
    cluster = named_cluster(17, {0: [[9.0]], 2: [[10.0]], 4: [[12.0]]})
    whole = tracked(1, (0, [("17/0/0", 0)]), (2, [("17/2/0", 0)]), (4, [("17/4/0", 0)]))
    assert score_association(cluster, [whole]) == AssociationScore(2, 2, 2)


@pytest.mark.parametrize(
    ("said", "later_mm", "score"),
    [
        (Presence.FALLEN, None, FateScore(1, 0, 0, 0)),
        (Presence.FALLEN, 9.5, FateScore(0, 1, 0, 0)),
        (Presence.NOT_SEEN, 9.5, FateScore(0, 0, 1, 0)),
        (Presence.NOT_SEEN, None, FateScore(0, 0, 0, 1)),
    ],
)
def test_what_is_said_of_the_missing_meets_the_truth(
    said: Presence, later_mm: float | None, score: FateScore
) -> None:
    truth = {"a": caliper_fruit(17, "a", {0: 9.0, 4: later_mm})}
    found = score_fates(GONE, [LOST[said]], truth)
    assert found == score
    assert found.right_pct == (100.0 if score.fallen or score.not_seen else 0.0)


def test_nothing_is_said_of_the_missing_whose_truth_is_not_known() -> None:
    track_ = LOST[Presence.FALLEN]
    assert score_fates(GONE, [track_], {}).right_pct is None
    assert score_fates(GONE, [track_], {"a": caliper_fruit(17, "a", {0: 9.0})}).right_pct is None


@pytest.mark.parametrize(
    "cluster",
    [
        pytest.param(GROWN, id="a picture shows it, so that it was only matched wrongly"),
        pytest.param(
            replace(GONE, out_of_sight=frozenset({("a", day(4))})), id="no picture shows its place"
        ),
    ],
)
def test_of_the_missing_only_what_pictures_can_tell_is_scored(cluster: NamedCluster) -> None:
    truth = {"a": caliper_fruit(17, "a", {0: 9.0, 4: None})}
    assert score_fates(cluster, [LOST[Presence.NOT_SEEN]], truth).right_pct is None


def test_readings_are_scored_from_pictures_to_forecasts() -> None:
    calipers = caliper_block(
        [
            caliper_fruit(17, name, {0: one, 4: other})
            for name, one, other in [("a", 9.1, 12.1), ("b", 8.1, 9.1), ("c", 7.6, 9.6)]
        ]
    )
    asked: list[BlockRecord] = []

    def forecast(block: BlockRecord) -> float:
        asked.append(block)
        return 10.0 * len(asked)

    score = score_readings("raft", [GROWN], calipers, forecast)
    assert [f.method for f in score.following] == list(Association)
    geometry = score.following[0]
    assert geometry.association == AssociationScore(4, 4, 4)
    assert (score.known_persist_pct, geometry.persist_pct) == (10.0, 20.0)
    assert [f.fruitlet for f in asked[0].fruitlets] == ["a", "b", "c", "d"]
    assert all(block.visits == (day(0), day(4)) for block in asked)
    assert list(score.by_day) == [day(0), day(4)]
    assert score.all_days.agreement is not None
    assert score.all_days.agreement.bias_mm == pytest.approx(-0.1)


def test_fruitlets_without_names_are_counted() -> None:
    cluster = named_cluster(17, {0: [[9.0, 8.0], [9.0]], 4: [[12.0, 9.0]]}, "a?")
    assert score_readings("raft", [cluster], caliper_block([]), lambda _: None).unnamed == 2


def test_the_operators_words_count() -> None:
    words = (MatchWord(Place("17/0/0", 0), Place("17/4/0", 1)),)
    turned = NamedCluster(17, GROWN.visits, GROWN.names, words)
    said = score_readings("raft", [turned], caliper_block([]), lambda _: None)
    assert said.following[0].association.right < 4
    assert score_association(GROWN, track(GROWN.visits)).right == 4


def test_differences_need_both_forecasts() -> None:
    assert aapd(37.5, 40.0) == 2.5 == aapd(40.0, 37.5)
    assert aapd(None, 40.0) is None is aapd(40.0, None)


def test_seconds_stand_beside_the_calipers() -> None:
    timed = seconds_of([4.0, 5.0, 12.0])
    assert timed is not None
    assert (timed.n, timed.mean_s, timed.median_s, timed.times_faster) == (3, 7.0, 5.0, 6.0)
    assert seconds_of([]) is None
