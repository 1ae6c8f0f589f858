"""What a look says of the aim, and when that fires by itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from made_cues import good_cue, tag
from made_states import AIM, ROUTE, shown_with

from fieldcam.session.aim.automatic import Automatic, accepted_since
from fieldcam.session.aim.cue import MAX_MOVED_MM, Cue, Zone, cue_of
from fieldcam.session.state import CameraState, WalkState
from fieldcam.store.queries.walks import ClusterState
from fieldcam.values import FARTHEST_MM, NEAREST_MM

DUE = 12
assert AIM.tag_id == DUE


@pytest.mark.parametrize(
    ("range_mm", "zone"),
    [
        (NEAREST_MM - 1, Zone.NEAR),
        (NEAREST_MM, Zone.GOOD),
        (FARTHEST_MM, Zone.GOOD),
        (FARTHEST_MM + 1, Zone.FAR),
    ],
)
def test_the_tag_is_near_good_or_far(range_mm: float, zone: Zone) -> None:
    cue = cue_of(DUE, [tag(DUE, range_mm)], None, flash_ready=True)
    assert (cue.zone, cue.range_mm) == (zone, range_mm)


def test_only_the_due_tag_counts() -> None:
    cue = cue_of(DUE, [tag(17), tag(DUE, 400.0), tag(3)], None, flash_ready=True)
    assert (cue.read, cue.range_mm) == ((3, DUE, 17), 400.0)
    assert cue_of(DUE, [tag(17)], None, flash_ready=True).zone is None
    assert cue_of(DUE, [tag(DUE), tag(DUE)], None, flash_ready=True).zone is None


def test_where_none_is_due_any_one_tag_counts() -> None:
    first = cue_of(None, [tag(17, 400.0)], None, flash_ready=True)
    assert first.in_view and first.range_mm == 400.0
    assert cue_of(None, [tag(17, 400.0)], first, flash_ready=True).ready
    assert not cue_of(None, [tag(17), tag(3)], None, flash_ready=True).in_view
    assert not cue_of(None, [], None, flash_ready=True).in_view


def test_a_new_tag_is_not_taken_by_itself() -> None:
    automatic = Automatic(on=True)
    assert not automatic.may(replace(AIM, tag_id=None, learning=True))


@pytest.mark.parametrize(
    ("moved_mm", "still"), [(0.0, True), (MAX_MOVED_MM, True), (MAX_MOVED_MM + 0.1, False)]
)
def test_stillness_is_told_from_two_looks(moved_mm: float, still: bool) -> None:
    first = cue_of(DUE, [tag(DUE, 440.0)], None, flash_ready=True)
    assert first.still is None and not first.ready
    second = cue_of(DUE, [tag(DUE, 440.0 + moved_mm)], first, flash_ready=True)
    assert (second.still, second.ready) == (still, still)


def test_another_clusters_look_says_nothing_of_stillness() -> None:
    before = cue_of(11, [tag(11), tag(DUE)], None, flash_ready=True)
    assert cue_of(DUE, [tag(DUE)], before, flash_ready=True).still is None


def test_without_a_calibration_there_is_no_range() -> None:
    flat = replace(tag(DUE), translation_mm=None)
    cue = cue_of(DUE, [flat], good_cue(DUE), flash_ready=True)
    assert (cue.zone, cue.still, cue.ready) == (None, None, False)


def test_the_flash_must_be_ready() -> None:
    assert good_cue(DUE).ready
    assert not replace(good_cue(DUE), flash_ready=False).ready


def fired(automatic: Automatic, cues: list[Cue], state: WalkState = AIM) -> list[bool]:
    return [automatic.pull(cue, state) for cue in cues]


GOOD, BAD = good_cue(DUE), Cue(DUE)


def test_it_fires_once_all_is_right_for_a_moment() -> None:
    automatic = Automatic(on=True)
    assert fired(automatic, [GOOD, BAD, GOOD, GOOD, GOOD, GOOD]) == [
        False, False, False, True, False, False,
    ]  # fmt: skip


def test_it_never_fires_twice_at_one_cluster() -> None:
    automatic = Automatic(on=True)
    assert fired(automatic, [GOOD, GOOD]) == [False, True]
    assert not any(fired(automatic, [GOOD] * 5))
    automatic.switch()
    automatic.switch()
    assert not any(fired(automatic, [GOOD] * 5))
    other = good_cue(21)
    assert fired(automatic, [other, other], replace(AIM, tag_id=21)) == [False, True]


@pytest.mark.parametrize("camera", [CameraState.LOST, CameraState.EXPOSING, CameraState.OPENING])
def test_it_waits_for_the_camera(camera: CameraState) -> None:
    assert not any(fired(Automatic(on=True), [GOOD] * 3, replace(AIM, camera=camera)))


def test_it_leaves_a_cluster_with_a_picture_alone(tmp_path: Path) -> None:
    state = replace(AIM, shown=shown_with(tmp_path))
    assert not any(fired(Automatic(on=True), [GOOD] * 3, state))


def test_it_fires_at_the_due_cluster_only() -> None:
    assert not any(fired(Automatic(on=True), [good_cue(11)] * 3))


def test_it_is_off_until_it_is_switched_on() -> None:
    automatic = Automatic()
    assert not any(fired(automatic, [GOOD] * 3))
    automatic.switch()
    assert fired(automatic, [GOOD, GOOD]) == [False, True]


def moved(state: ClusterState, tag_id: int | None = 21) -> WalkState:
    """The next state, in which tag 12 is like this."""
    stops = tuple(replace(s, state=state) if s.tag_id == DUE else s for s in ROUTE.stops)
    return replace(AIM, tag_id=tag_id, route=replace(ROUTE, stops=stops))


def test_going_on_after_an_acceptance_is_told_from_the_states(tmp_path: Path) -> None:
    accepted = moved(ClusterState.ACCEPTED)
    assert accepted_since(AIM, accepted)
    assert not accepted_since(AIM, AIM)
    assert not accepted_since(AIM, moved(ClusterState.SKIPPED))
    assert not accepted_since(AIM, moved(ClusterState.ACCEPTED, None))
    assert not accepted_since(AIM, replace(accepted, shown=shown_with(tmp_path)))
    assert not accepted_since(moved(ClusterState.ACCEPTED, DUE), accepted)
