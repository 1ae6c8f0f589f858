"""Whether a missing fruitlet has fallen is told by what is seen at its place."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_clusters import Pose, Sphere, made_view, made_visit, ring
from test_association import followed, later

from fieldcam.growth.fate import chance_fallen
from fieldcam.growth.places import ClusterVisit, Place, Track
from fieldcam.growth.records import Presence
from fieldcam.growth.tracking import track

GONE = 1
"""Its place is at the cluster's right, where no other fruitlet hangs before it."""
LEAF = Pose(leaf_mm={"from": 8.0, "to": 40.0})


def remaining(spheres: list[Sphere]) -> list[Sphere]:
    return [s for s in spheres if s.id != GONE]


def of_gone(tracks: tuple[Track, ...]) -> Track:
    return next(t for t in tracks if set(followed([t])[0]) == {GONE})


def presences(visits: list[ClusterVisit]) -> list[Presence]:
    return [v.sighting.presence for v in of_gone(track(visits)).visits.values()]


def missing_at(day: int, pose: Pose | None = None, times: int = 1) -> ClusterVisit:
    spheres = ring()
    for _ in range(times):
        spheres = later(spheres)
    return made_visit(day, made_view(f"day{day}", remaining(spheres), pose))


START = made_visit(0, made_view("a", ring()))


def test_empty_place_in_full_view_is_a_fallen_fruitlet() -> None:
    assert presences([START, missing_at(2)]) == [Presence.SIZED, Presence.FALLEN]


def test_place_behind_a_leaf_is_not_seen() -> None:
    assert presences([START, missing_at(2, LEAF)]) == [Presence.SIZED, Presence.NOT_SEEN]


def test_second_picture_past_the_leaf_shows_that_it_fell() -> None:
    both = replace(
        missing_at(2, LEAF),
        views=(*missing_at(2, LEAF).views, made_view("c", remaining(later(ring())))),
    )
    assert presences([START, both]) == [Presence.SIZED, Presence.FALLEN]


@pytest.mark.parametrize(
    ("aside_px", "expected"), [(10.0, Presence.NOT_SEEN), (400.0, Presence.FALLEN)]
)
def test_something_faint_at_its_place_may_be_the_fruitlet(
    aside_px: float, expected: Presence
) -> None:
    whole = made_view("whole", later(ring())).reading
    x, y = next(f.center_px for f in whole.fruitlets if f.id == GONE)
    visit = missing_at(2)
    (view,) = visit.views
    faint = replace(view, reading=replace(view.reading, faint_px=((x + aside_px, y),)))
    assert presences([START, replace(visit, views=(faint,))])[1] is expected


def test_looking_past_the_place_once_is_worth_more_than_two_doubtful_looks() -> None:
    leaf = missing_at(2, LEAF)
    twice = replace(leaf, views=(*leaf.views, replace(leaf.views[0], id="again")))
    assert presences([START, twice])[1] is Presence.NOT_SEEN


def test_fruitlet_that_is_back_later_had_not_fallen() -> None:
    back = made_visit(4, made_view("c", later(later(ring()))))
    assert presences([START, missing_at(2), back]) == [
        Presence.SIZED, Presence.NOT_SEEN, Presence.SIZED,
    ]  # fmt: skip


def test_fallen_stays_fallen_behind_a_leaf() -> None:
    visits = [START, missing_at(2), missing_at(4, LEAF, 2)]
    assert presences(visits) == [Presence.SIZED, Presence.FALLEN, Presence.FALLEN]


def test_visit_without_a_picture_decides_nothing() -> None:
    empty = ClusterVisit(missing_at(2).day, ())
    assert presences([START, empty]) == [Presence.SIZED, Presence.NOT_SEEN]


@pytest.mark.parametrize(
    ("fallen", "hidden", "pose", "expected"),
    [(1, 0, LEAF, Presence.FALLEN), (0, 1, None, Presence.NOT_SEEN)],
    ids=["fallen", "hidden"],
)
def test_operators_mark_comes_first(
    fallen: int, hidden: int, pose: Pose | None, expected: Presence
) -> None:
    marked = replace(missing_at(2, pose), fallen=fallen, hidden=hidden)
    assert presences([START, marked])[1] is expected


@pytest.mark.parametrize("fell", [0, 1])
def test_which_has_fallen_and_which_is_hidden_is_as_the_operator_said(fell: int) -> None:
    """Of two that are missing alike."""
    gone = (GONE, 0)
    whole = made_view("b", later(ring())).reading
    left = tuple(f for f in whole.fruitlets if f.id not in gone)
    view = replace(made_view("b", later(ring())), reading=replace(whole, fruitlets=left))
    said = replace(
        made_visit(2, view),
        fallen=1,
        hidden=1,
        said_fallen=frozenset({Place("a", gone[fell])}),
        said_hidden=frozenset({Place("a", gone[1 - fell])}),
    )
    tracks = track([START, said])
    fates = {
        track.visits[START.day].places[0].fruitlet: track.visits[said.day].sighting.presence
        for track in tracks
    }
    assert fates[gone[fell]] is Presence.FALLEN
    assert fates[gone[1 - fell]] is Presence.NOT_SEEN


def test_marked_on_the_picture_it_fell_that_day() -> None:
    view = replace(made_view("b", later(ring())), fallen=frozenset({GONE}))
    assert presences([START, made_visit(2, view)]) == [Presence.SIZED, Presence.FALLEN]


def test_chance_of_a_fall_grows_with_every_visit_that_would_have_shown_it() -> None:
    once, twice = chance_fallen([0.9]), chance_fallen([0.9, 0.9])
    assert twice[0] > once[0]
    assert twice[1] > twice[0]
    assert chance_fallen([0.0])[0] == pytest.approx(0.1)
    assert chance_fallen([]) == []
