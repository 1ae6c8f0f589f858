"""A printed board is found in both eyes, its corners where they are."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest
from rendered_boards import (
    Head,
    Pose,
    photograph,
    printed_charuco,
    printed_checkerboard,
    random_head,
)

from fieldcam.calibration.boards import LOOKS, Board, Corners, Kind, find_corners, match_eyes
from fieldcam.calibration.calibrating import BoardPair, UnseenBoard, calibrate, look, see
from fieldcam.errors import BadInput, CalibrationInvalid
from fieldcam.report.board_sheets import board_sheet
from fieldcam.report.pdf import pdf_document
from fieldcam.report.tag_sheets import MARGIN_MM, Paper, Rectangle
from fieldcam.values import ImageU8

CHECKERBOARD = Board(Kind.CHECKERBOARD, 9, 6, 20.0)
CHARUCO = Board(Kind.CHARUCO, 9, 6, 20.0)
PRINTED = {CHECKERBOARD: printed_checkerboard(9, 6, 20.0), CHARUCO: printed_charuco(9, 6, 20.0)}
RECTANGLE = re.compile(rb"([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+) re\n")
PX_PER_MM = 4

Pictures = dict[Board, tuple[ImageU8, ImageU8]]


@pytest.fixture(scope="module")
def head() -> Head:
    return random_head(np.random.default_rng(3)).shrunk(2)


def held(range_mm: float = 420.0, x_mm: float = -50.0, turn_deg: float = 8.0) -> Pose:
    """Upper left corner to the left of the left eye's axis, left edge nearer, a little rolled."""
    cos, sin = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    yaw = np.array([(0.9, 0, -0.436), (0, 1, 0), (0.436, 0, 0.9)])
    roll = np.array([(cos, -sin, 0), (sin, cos, 0), (0, 0, 1)])
    return Pose(np.asarray(yaw @ roll), np.array([x_mm, -60.0, range_mm]))


@pytest.fixture(scope="module")
def pictures(head: Head) -> Pictures:
    """Both eyes' pictures of each board."""
    rng = np.random.default_rng(1)
    return {board: photograph(head, printed, held(), rng) for board, printed in PRINTED.items()}


@pytest.mark.parametrize("board", [CHECKERBOARD, CHARUCO], ids=lambda board: str(board.kind))
def test_corners_lie_where_they_are(head: Head, pictures: Pictures, board: Board) -> None:
    view = see(board, BoardPair("1", *pictures[board]))
    assert not isinstance(view, UnseenBoard) and len(view.board_mm) == 40
    pose, right = held(), head.right_pose(held())
    # Nothing says from which side OpenCV counts the corners of a checkerboard.
    counted = (view.board_mm, view.board_mm[::-1])
    true = [head.left.seen(at @ pose.rotation.T + pose.place_mm) for at in counted]
    board_mm = min(
        zip(true, counted, strict=True), key=lambda c: np.abs(c[0] - view.left_px).max()
    )[1]
    for places, lens, own in (
        (view.left_px, head.left, pose),
        (view.right_px, head.right, right),
    ):
        off = places - lens.seen(board_mm @ own.rotation.T + own.place_mm)
        assert np.sqrt((off**2).mean()) < 0.06
        assert np.abs(off).max() < 0.25


def test_a_part_of_a_charuco_board_is_enough(head: Head) -> None:
    left, right = photograph(head, PRINTED[CHARUCO], held(x_mm=-190.0), np.random.default_rng(1))
    view = see(CHARUCO, BoardPair("1", left, right))
    assert not isinstance(view, UnseenBoard) and 9 <= len(view.board_mm) < 40


def test_a_charuco_board_as_it_was_drawn_before_opencv_4_6(head: Head, pictures: Pictures) -> None:
    older = printed_charuco(9, 6, 20.0, older=True)
    view = see(CHARUCO, BoardPair("1", *photograph(head, older, held(), np.random.default_rng(1))))
    now = see(CHARUCO, BoardPair("1", *pictures[CHARUCO]))
    assert not isinstance(view, UnseenBoard) and not isinstance(now, UnseenBoard)
    assert np.abs(view.left_px - now.left_px).max() < 0.3


def test_a_board_with_markers_of_another_family_is_named(head: Head) -> None:
    other = printed_charuco(9, 6, 20.0, cv2.aruco.DICT_ARUCO_ORIGINAL)
    pair = BoardPair("1", *photograph(head, other, held(), np.random.default_rng(1)))
    with pytest.raises(CalibrationInvalid) as refused:
        calibrate(CHARUCO, look(CHARUCO, [pair]))
    assert "Its markers are of ArUco original, where ArUco 5x5 is read" in refused.value.hint


@pytest.mark.parametrize("blind_to", LOOKS)
def test_a_checkerboard_is_looked_for_in_more_than_one_way(
    pictures: Pictures, monkeypatch: pytest.MonkeyPatch, blind_to: int
) -> None:
    """OpenCV finds some boards only with this flag, others only without."""
    find = cv2.findChessboardCornersSB

    def found(grey: ImageU8, grid: tuple[int, int], flags: int) -> object:
        return (False, None) if flags == blind_to else find(grey, grid, flags=flags)

    monkeypatch.setattr(cv2, "findChessboardCornersSB", found)
    assert len(find_corners(CHECKERBOARD, pictures[CHECKERBOARD][0]).ids) == 40


def test_a_checkerboard_seen_from_the_other_side_is_turned_back(pictures: Pictures) -> None:
    left, right = pictures[CHECKERBOARD]
    found = find_corners(CHECKERBOARD, left), find_corners(CHECKERBOARD, right)
    turned = Corners(found[1].ids, found[1].places_px[::-1].copy())
    straight = match_eyes(CHECKERBOARD, "1", *found)
    back = match_eyes(CHECKERBOARD, "1", found[0], turned)
    assert straight is not None and back is not None
    assert np.array_equal(straight.right_px, back.right_px)


@pytest.mark.parametrize(
    ("blind", "why"),
    [
        ((), ""),
        ((1,), "only the left eye sees the board"),
        ((0,), "only the right eye sees the board"),
        ((0, 1), "neither eye sees the board"),
    ],
)
def test_what_an_eye_does_not_see_is_said(
    pictures: Pictures, blind: tuple[int, ...], why: str
) -> None:
    eyes = list(pictures[CHARUCO])
    for eye in blind:
        eyes[eye] = np.full_like(eyes[eye], 90)
    found = see(CHARUCO, BoardPair("1", *eyes))
    assert (found.why if isinstance(found, UnseenBoard) else "") == why


@pytest.mark.parametrize(
    ("kind", "columns", "rows", "words"),
    [
        (Kind.CHECKERBOARD, 7, 7, "looks the same from all sides"),
        (Kind.CHECKERBOARD, 3, 6, "cannot be used"),
        (Kind.CHARUCO, 9, 41, "cannot be used"),
    ],
)
def test_a_board_that_cannot_work_is_refused(
    kind: Kind, columns: int, rows: int, words: str
) -> None:
    with pytest.raises(BadInput, match=words):
        Board(kind, columns, rows, 20.0)


def printed(board: Board, paper: Paper) -> ImageU8:
    """What a printer of PX_PER_MM makes of the file."""
    document = pdf_document([board_sheet(board, paper)], paper)
    width, height = (round(side * PX_PER_MM) for side in paper.value)
    image = np.full((height, width), 255, np.uint8)
    for found in RECTANGLE.findall(document):
        box = Rectangle(*map(float, found))
        assert min(box.x_mm, box.y_mm) >= MARGIN_MM - 0.5
        assert box.x_mm + box.width_mm <= paper.value[0] - MARGIN_MM + 0.5
        x0, x1 = box.x_mm * PX_PER_MM, (box.x_mm + box.width_mm) * PX_PER_MM
        y0, y1 = box.y_mm * PX_PER_MM, (box.y_mm + box.height_mm) * PX_PER_MM
        image[round(height - y1) : round(height - y0), round(x0) : round(x1)] = 0
    return image


@pytest.mark.parametrize(
    ("board", "paper"),
    [
        (CHECKERBOARD, Paper.A4),
        (CHARUCO, Paper.LETTER),
        (Board(Kind.CHARUCO, 12, 8, 20.0), Paper.A4),  # fits only when turned
        (Board(Kind.CHARUCO, 5, 8, 30.0), Paper.A4),
    ],
    ids=["checkerboard", "charuco", "turned", "upright"],
)
def test_a_printed_board_is_found_at_its_size(board: Board, paper: Paper) -> None:
    corners = find_corners(board, printed(board, paper))
    assert len(corners.ids) == len(board.corners_mm)
    spots, expected_mm = corners.places_px / PX_PER_MM, board.corners_mm[corners.ids]
    for other in (1, len(spots) // 2, len(spots) - 1):
        found_mm = np.linalg.norm(spots[other] - spots[0])
        assert found_mm == pytest.approx(
            np.linalg.norm(expected_mm[other] - expected_mm[0]), abs=0.1
        )


def test_a_board_larger_than_the_paper_is_refused() -> None:
    with pytest.raises(BadInput, match="does not fit on a4"):
        board_sheet(Board(Kind.CHARUCO, 12, 9, 30.0), Paper.A4)
