"""The camera comes out as it is, spoiled views do not count, and nonsense is refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from rendered_boards import (
    Array,
    Head,
    Pose,
    printed_checkerboard,
    random_head,
    random_poses,
)

from fieldcam.calibration.boards import Board, BoardView, Kind, Pixels
from fieldcam.calibration.calibrating import Calibrated, Looked, calibrate
from fieldcam.errors import CalibrationInvalid

BOARD = Board(Kind.CHECKERBOARD, 9, 6, 20.0)
NOISE_PX = 0.05
STEP_MM = np.array([3.0, 0.0, 8.0])


def view(
    rng: np.random.Generator, head: Head, pose: Pose, name: str, right: Pose | None = None
) -> BoardView:
    """The board's corners as both eyes would find them."""
    other = head.right_pose(right or pose)
    return BoardView(
        name,
        BOARD.corners_mm,
        _found(rng, head.left.seen(BOARD.corners_mm @ pose.rotation.T + pose.place_mm)),
        _found(rng, head.right.seen(BOARD.corners_mm @ other.rotation.T + other.place_mm)),
    )


def _found(rng: np.random.Generator, places: Array) -> Pixels:
    return (places + rng.normal(0, NOISE_PX, places.shape)).astype(np.float32)


def views(rng: np.random.Generator, head: Head, count: int = 16) -> Iterator[BoardView]:
    poses = random_poses(rng, head, printed_checkerboard(9, 6, 20.0), count)
    yield from (view(rng, head, pose, str(i)) for i, pose in enumerate(poses, 1))


def solved(found: Iterator[BoardView] | list[BoardView]) -> Calibrated:
    return calibrate(BOARD, Looked(tuple(found), (), (1440, 1080)))


def assert_is(result: Calibrated, head: Head) -> None:
    for lens, true in ((result.camera.left, head.left), (result.camera.right, head.right)):
        assert lens.camera_matrix[0, 0] == pytest.approx(true.fx, rel=2e-3)
        assert lens.camera_matrix[1, 1] == pytest.approx(true.fy, rel=2e-3)
        assert lens.distortion[0] == pytest.approx(true.distortion[0], abs=0.02)
        assert lens.distortion[4] == 0
    assert result.camera.baseline_mm == pytest.approx(head.baseline_mm, abs=0.1)
    assert np.allclose(result.camera.rotation, head.rotation, atol=1e-3)
    assert result.rms_px < 3 * NOISE_PX and result.rows_px < 3 * NOISE_PX


@pytest.mark.parametrize("seed", range(3))
def test_the_camera_comes_out_as_it_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    head = random_head(rng)
    result = solved(views(rng, head))
    assert_is(result, head)
    assert len(result.kept) == 16
    pose = next(iter(random_poses(rng, head, printed_checkerboard(9, 6, 20.0), 1)))
    probe = result.rig.rectified
    assert probe.baseline_mm == result.camera.baseline_mm
    assert probe.range_mm(probe.disparity_px(pose.place_mm[2])) == pytest.approx(pose.place_mm[2])


def test_what_the_others_contradict_does_not_count() -> None:
    rng = np.random.default_rng(11)
    head = random_head(rng)
    good = list(views(rng, head, 14))
    pose = Pose(np.eye(3), np.array([-70.0, -50.0, 430.0]))
    moved = view(
        rng, head, pose, "moved", Pose(pose.rotation, pose.place_mm + np.array([2.0, 1.0, -3.0]))
    )
    smeared = view(rng, head, pose, "smeared")
    smeared = replace(smeared, left_px=smeared.left_px + rng.normal(0, 1.5, (40, 2)).astype("f4"))
    turned = view(rng, head, pose, "turned")
    turned = replace(turned, right_px=turned.right_px[::-1].copy())
    result = solved([*good[:5], moved, *good[5:9], smeared, turned, *good[9:]])
    assert_is(result, head)
    dropped = {
        each.judged.view.name: each.judged.why_dropped
        for each in result.views
        if each.judged.why_dropped
    }
    assert dropped.keys() == {"moved", "smeared", "turned"}
    assert "not of one moment" in dropped["moved"] and "not of one moment" in dropped["turned"]
    assert "blurred" in dropped["smeared"]


def refused(found: list[BoardView]) -> str:
    with pytest.raises(CalibrationInvalid) as refusal:
        solved(found)
    assert refusal.value.hint
    return str(refusal.value)


def test_too_few_views_are_refused() -> None:
    rng = np.random.default_rng(2)
    assert "in 7 of the pairs" in refused(list(views(rng, random_head(rng), 7)))


def test_one_pose_over_and_over_is_refused() -> None:
    rng = np.random.default_rng(2)
    head = random_head(rng)
    tilted = next(iter(random_poses(rng, head, printed_checkerboard(9, 6, 20.0), 1)))
    for pose in (tilted, Pose(np.eye(3), np.array([-70.0, -50.0, 430.0]))):
        held = [replace(pose, place_mm=pose.place_mm + i * STEP_MM) for i in range(12)]
        found = [view(rng, head, each, str(i)) for i, each in enumerate(held)]
        assert "tilted the same way" in refused(found)


def test_swapped_eyes_are_refused() -> None:
    rng = np.random.default_rng(2)
    swapped = [
        replace(each, left_px=each.right_px, right_px=each.left_px)
        for each in views(rng, random_head(rng))
    ]
    assert "eyes are swapped" in refused(swapped)


def test_eyes_above_each_other_are_refused() -> None:
    rng = np.random.default_rng(2)
    head = random_head(rng)
    stacked = replace(head, translation_mm=np.array([1.0, -60.0, 0.5]))
    assert "side by side" in refused(list(views(rng, stacked)))


@pytest.mark.parametrize("factor", [0.1, 20.0])
def test_an_implausible_square_is_refused(factor: float) -> None:
    rng = np.random.default_rng(2)
    scaled = [
        replace(each, board_mm=each.board_mm * np.float32(factor))
        for each in views(rng, random_head(rng))
    ]
    assert "--square-mm" in refused(scaled)


def test_views_that_only_contradict_each_other_are_refused() -> None:
    rng = np.random.default_rng(2)
    head = random_head(rng)
    found = list(views(rng, head, 12))
    spoiled = [
        replace(each, right_px=each.right_px + rng.normal(0, 40, 2).astype("f4")) if i % 2 else each
        for i, each in enumerate(found)
    ]
    assert "contradict each other" in refused(spoiled)


def fisheye_views(
    rng: np.random.Generator, focal_px: float, count: int = 14
) -> Iterator[BoardView]:
    """The board close before two lenses that bend as fisheyes do, 60 mm apart."""
    camera = np.array([(focal_px, 0, 719.5), (0, focal_px, 539.5), (0, 0, 1.0)])
    still, bend = np.zeros(3), np.array([0.02, -0.01, 0.0, 0.0])
    board = BOARD.corners_mm.astype(np.float64)
    for name in range(count):
        turn = cv2.Rodrigues(rng.uniform(-0.6, 0.6, 3) * (1, 1, 0.5))[0]
        z_mm = rng.uniform(70, 150)
        place = np.array([rng.uniform(-0.4, 0.4) * z_mm, rng.uniform(-0.3, 0.3) * z_mm, z_mm])
        points = (board - board.mean(axis=0)) @ turn.T + place
        of_right = points - np.array([60.0, 0.0, 0.0])
        eyes = (
            cv2.fisheye.projectPoints(own[None], still, still, camera, bend)[0]
            for own in (points, of_right)
        )
        left, right = (_found(rng, np.asarray(eye, np.float64)[0]) for eye in eyes)
        yield BoardView(str(name), BOARD.corners_mm, left, right)


@pytest.mark.parametrize("focal_px", [450.0, 600.0])
def test_a_fisheye_lens_is_told_and_no_more_pictures_asked_for(focal_px: float) -> None:
    with pytest.raises(CalibrationInvalid, match="bends its picture as a fisheye does") as caught:
        solved(fisheye_views(np.random.default_rng(2), focal_px))
    assert caught.value.hint.startswith("More pictures do not help")
