"""Whoever holds the board is told what is still missing, until nothing is."""

from __future__ import annotations

import numpy as np
import pytest
from rendered_boards import Head, Lens, Pose

from fieldcam.calibration.boards import Board, BoardView, Kind
from fieldcam.calibration.coverage import COLUMN_WORDS, ROW_WORDS, SeenBoard, coverage
from fieldcam.calibration.guide import Guide
from fieldcam.calibration.poses import Tilt, usual_pose

BOARD = Board(Kind.CHECKERBOARD, 9, 6, 20.0)
SIZE = (1440, 1080)
MIDDLE_MM = np.array([90.0, 60.0, 0.0])
LENS = Lens(1728.0, 1728.0, 719.5, 539.5, (0.0, 0.0, 0.0, 0.0, 0.0))
HEAD = Head(LENS, LENS, np.eye(3), np.array([-60.0, 0.0, 0.0]))
TILTED_DEG = 30.0
AXES = {
    Tilt.UPPER: (1.0, 0.0),
    Tilt.LOWER: (-1.0, 0.0),
    Tilt.LEFT: (0.0, -1.0),
    Tilt.RIGHT: (0.0, 1.0),
    Tilt.FLAT: (0.0, 0.0),
}
"""About which axes (x, y) the board is turned for it, by the right hand."""


def held(tilt: Tilt, range_mm: float, left_x_px: float, y_px: float) -> BoardView:
    """The board with its middle at this place of the left picture."""
    turn = np.radians(TILTED_DEG) * np.array([*AXES[tilt], 0.0])
    angle = float(np.linalg.norm(turn))
    x, y, z = turn / angle if angle else turn
    cross = np.array([(0, -z, y), (z, 0, -x), (-y, x, 0)])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    away = np.array([(left_x_px - LENS.cx) / LENS.fx, (y_px - LENS.cy) / LENS.fy, 1.0]) * range_mm
    pose = Pose(rotation, away - rotation @ MIDDLE_MM)
    right = HEAD.right_pose(pose)
    return BoardView(
        "1",
        BOARD.corners_mm,
        LENS.seen(BOARD.corners_mm @ pose.rotation.T + pose.place_mm).astype(np.float32),
        LENS.seen(BOARD.corners_mm @ right.rotation.T + right.place_mm).astype(np.float32),
    )


@pytest.mark.parametrize("tilt", list(AXES))
@pytest.mark.parametrize("range_mm", [320.0, 450.0, 600.0])
def test_tilt_and_range_are_told_before_the_camera_is_known(tilt: Tilt, range_mm: float) -> None:
    view = held(tilt, range_mm, 800.0, 540.0)
    pose = usual_pose(view.board_mm, view.left_px, SIZE)
    assert pose is not None and pose.tilt is tilt
    assert pose.range_mm == pytest.approx(range_mm, rel=0.01)
    assert pose.tilt_deg == pytest.approx(0 if tilt is Tilt.FLAT else TILTED_DEG, abs=0.5)


def test_nothing_is_covered_before_the_first_view() -> None:
    found = coverage([], SIZE)
    shared = 2 * (len(COLUMN_WORDS) - 1) * len(ROW_WORDS)
    assert len(found.missing_cells) == shared
    assert len(found.missing_words) == shared + 2 + 4
    assert len(found.next_words) == 3


def test_one_view_covers_where_it_is() -> None:
    view = held(Tilt.LEFT, 420.0, 900.0, 540.0)
    pose = usual_pose(view.board_mm, view.left_px, SIZE)
    assert pose is not None
    found = coverage([SeenBoard(view.left_px, view.right_px, pose)], SIZE)
    assert found.left.sum() == found.right.sum() == 40
    assert found.left[:, 0].sum() == 0, "the board is right of the middle"
    missing = {cell[1:] for cell in found.missing_cells if cell.eye == "left"}
    assert (1, 2) not in missing and (0, 3) in missing
    assert set(found.missing_tilts) == set(AXES) - {Tilt.LEFT, Tilt.FLAT}
    assert len(found.missing_distances) == 2


def test_the_same_view_again_is_not_kept() -> None:
    guide = Guide(SIZE, enough=20)
    first = guide.consider(held(Tilt.LEFT, 420.0, 900.0, 540.0))
    again = guide.consider(held(Tilt.LEFT, 421.0, 902.0, 540.0))
    elsewhere = guide.consider(held(Tilt.LEFT, 420.0, 800.0, 640.0))
    assert (first.keep, again.keep, elsewhere.keep) == (True, False, True)
    assert guide.kept == 2 and again.text.startswith("Nothing new. Hold the board in the ")


def test_whoever_follows_the_guide_comes_to_an_end() -> None:
    """A board held where and how each sentence says, and no cleverer."""
    guide = Guide(SIZE, enough=16)
    rng = np.random.default_rng(5)
    tilts = {tilt.value: tilt for tilt in AXES}
    for _ in range(60):
        wish = guide.wish
        if guide.done:
            break
        tilt = next((t for word, t in tilts.items() if word in wish), Tilt.FLAT)
        range_mm = 350.0 if "closer (" in wish else 560.0
        x_px, y_px = rng.uniform(500, 1150), rng.uniform(250, 830)
        disparity_px = LENS.fx * 60.0 / range_mm
        if "of the left picture" in wish or "of the right picture" in wish:
            column = next(
                i
                for i, word in ((1, "middle left"), (2, "middle right"), (0, "left"), (3, "right"))
                if f"{word} part" in wish or f"{word} corner" in wish
            )
            x_px = (0.1, 0.35, 0.65, 0.9)[column] * SIZE[0]
            x_px += disparity_px if "of the right picture" in wish else 0
            row = 0 if "in the upper" in wish else 2 if "in the lower" in wish else 1
            y_px = (0.12, 0.5, 0.88)[row] * SIZE[1]
        reach_px = LENS.fx * 90 / range_mm, LENS.fx * 60 / range_mm
        view = held(
            tilt,
            range_mm,
            float(np.clip(x_px, disparity_px + reach_px[0], SIZE[0] - reach_px[0])),
            float(np.clip(y_px, reach_px[1], SIZE[1] - reach_px[1])),
        )
        guide.consider(view)
    assert guide.done, guide.wish
    assert guide.wish == "That is enough."
