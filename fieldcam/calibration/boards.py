"""Calibration boards, and their corners in a picture to a few hundredths of a pixel."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.calibration.aruco_families import marker_counts
from fieldcam.errors import BadInput
from fieldcam.images.grey import as_grey
from fieldcam.values import ImageU8

Pixels = npt.NDArray[np.float32]
"""(N, 2) float32: x, y."""
Ids = npt.NDArray[np.intp]

MIN_SQUARES, MAX_SQUARES = 4, 40
"""To a side; below, OpenCV looks for no board."""
MARKER_CELLS, SQUARE_CELLS = 7, 9
"""Of a ChArUco board: a marker of 5x5 bits and its border, one cell of white around it."""
MARKERS = (
    (50, cv2.aruco.DICT_5X5_50),
    (100, cv2.aruco.DICT_5X5_100),
    (250, cv2.aruco.DICT_5X5_250),
    (1000, cv2.aruco.DICT_5X5_1000),
)
"""Each family begins with the one before it; a small one is searched twelve times as fast.
None of these markers is an AprilTag."""
MARKER_FAMILY = "ArUco 5x5"
MIN_MARKERS, MIN_MARKER_PX = 3, 10.0
"""Of one family, before a picture counts as showing it."""
MIN_LINES = 3
"""Columns and rows of corners that must be seen; fewer lie as good as in one line."""
LOOKS = (cv2.CALIB_CB_NORMALIZE_IMAGE, 0)
"""Without the first some boards near the edge of a flash's light are not found, and with it
some in even light are not."""
REFINED = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-3)
NARROWEST_PX, WIDEST_PX = 2, 11
"""Half the side of the window in which a corner is refined."""


class Kind(StrEnum):
    """What is printed on a board."""

    CHECKERBOARD = "checkerboard"
    CHARUCO = "charuco"
    """Squares with markers in the white ones; a part of the board is enough."""


@dataclass(frozen=True)
class Board:
    """A flat board of black and white squares; a corner is where four of them meet."""

    kind: Kind
    columns: int
    """Of squares, not of corners."""
    rows: int
    square_mm: float

    def __post_init__(self) -> None:
        sides = self.columns, self.rows
        if not all(MIN_SQUARES <= side <= MAX_SQUARES for side in sides):
            raise BadInput(
                f"A board of {self.columns} x {self.rows} squares cannot be used.",
                f"Choose {MIN_SQUARES} to {MAX_SQUARES} squares to a side.",
            )
        if self.kind is Kind.CHECKERBOARD and self.columns == self.rows:
            raise BadInput(
                "A checkerboard with as many columns as rows looks the same from all sides.",
                "Use one with different numbers, such as 9x6, or a ChArUco board.",
            )

    @property
    def grid(self) -> tuple[int, int]:
        """Columns and rows of corners."""
        return self.columns - 1, self.rows - 1

    @cached_property
    def corners_mm(self) -> Pixels:
        """(N, 3) float32: every corner by its id, row by row, z = 0."""
        row, column = np.divmod(np.arange(self.grid[0] * self.grid[1]), self.grid[0])
        flat = np.column_stack((column + 1, row + 1, np.zeros_like(row)))
        return (flat * self.square_mm).astype(np.float32)

    @cached_property
    def older_charuco(self) -> cv2.aruco.CharucoBoard:
        """The board as OpenCV drew it before 4.6; another one only where its rows are even."""
        board = self._drawn()
        board.setLegacyPattern(True)
        return board

    @cached_property
    def charuco(self) -> cv2.aruco.CharucoBoard:
        """The board as OpenCV knows it."""
        return self._drawn()

    def _drawn(self) -> cv2.aruco.CharucoBoard:
        marker_mm = self.square_mm * MARKER_CELLS / SQUARE_CELLS
        needed = self.columns * self.rows // 2
        family = next(family for count, family in MARKERS if count >= needed)
        dictionary = cv2.aruco.getPredefinedDictionary(family)
        size = self.columns, self.rows
        return cv2.aruco.CharucoBoard(size, self.square_mm, marker_mm, dictionary)


@dataclass(frozen=True, slots=True, eq=False)
class Corners:
    """The corners of a board that one eye sees; none at all where it sees no board."""

    ids: Ids
    """(N,)"""
    places_px: Pixels


@dataclass(frozen=True, slots=True, eq=False)
class BoardView:
    """The same corners of the board as both eyes see them."""

    name: str
    board_mm: Pixels
    """(N, 3) float32, z = 0."""
    left_px: Pixels
    right_px: Pixels


def find_corners(board: Board, image: ImageU8) -> Corners:
    """What is seen of the board in a picture (H, W) or (H, W, 3); distortion is left in it."""
    grey = as_grey(image)
    if board.kind is Kind.CHARUCO:
        return _find_charuco(board, grey)
    return _find_checkerboard(board, grey)


def seen_markers(image: ImageU8) -> str:
    """The family of most markers of a picture (H, W, 3) or (H, W); empty where too few tell."""
    grey = as_grey(image)
    counts = marker_counts(grey, MIN_MARKER_PX)
    family = max(counts, key=lambda name: counts[name])
    return family if counts[family] >= MIN_MARKERS else ""


def match_eyes(board: Board, name: str, left: Corners, right: Corners) -> BoardView | None:
    """The corners that both eyes see; None where they are too few to tell the board's pose."""
    if board.kind is Kind.CHECKERBOARD and _opposed(left, right):
        # From the other side a checkerboard is another one; nothing marks its first corner.
        right = Corners(right.ids, np.ascontiguousarray(right.places_px[::-1]))
    ids, of_left, of_right = np.intersect1d(left.ids, right.ids, return_indices=True)
    lines = (len(np.unique(part)) for part in np.divmod(ids, board.grid[0]))
    if min(lines) < MIN_LINES:
        return None
    return BoardView(
        name, board.corners_mm[ids], left.places_px[of_left], right.places_px[of_right]
    )  # fmt: skip


def _find_checkerboard(board: Board, grey: ImageU8) -> Corners:
    for look in LOOKS:
        found, places = cv2.findChessboardCornersSB(grey, board.grid, flags=look)
        if found:
            ids = np.arange(len(board.corners_mm))
            half_px = _spacing_px(board, ids, places) / 5
            return Corners(ids, _refined(grey, np.asarray(places), half_px))
    return _nothing()


def _find_charuco(board: Board, grey: ImageU8) -> Corners:
    """Of either pattern: before OpenCV 4.6 a board of even rows began with the other colour."""
    for pattern in (board.charuco, board.older_charuco):
        places, ids, _, _ = cv2.aruco.CharucoDetector(pattern).detectBoard(grey)
        if ids is not None and len(ids) >= MIN_LINES:
            return _charuco_corners(board, grey, places, ids)
    return _nothing()


def _charuco_corners(
    board: Board, grey: ImageU8, places: npt.NDArray[np.generic], ids: npt.NDArray[np.generic]
) -> Corners:
    known = np.asarray(ids, np.intp).ravel()
    # A wider window would reach the markers.
    half_px = _spacing_px(board, known, places) / (SQUARE_CELLS + 1)
    return Corners(known, _refined(grey, np.asarray(places), half_px))


def _nothing() -> Corners:
    return Corners(np.zeros(0, np.intp), np.zeros((0, 2), np.float32))


def _opposed(left: Corners, right: Corners) -> bool:
    """Whether the rows of corners run against each other in the two eyes."""
    if not (len(left.ids) and len(right.ids)):
        return False
    ways = (eye.places_px[-1] - eye.places_px[0] for eye in (left, right))
    return bool(np.dot(*ways) < 0)


def _spacing_px(board: Board, ids: Ids, places: npt.ArrayLike) -> float:
    """The smallest distance of two neighbours; a whole board's length where none is known."""
    at = dict(zip(ids.tolist(), np.asarray(places, np.float64).reshape(-1, 2), strict=True))
    columns = board.grid[0]
    gaps = [
        float(np.linalg.norm(at[other] - at[each]))
        for each in at
        for other in (each + 1, each + columns)
        if other in at and (other % columns or other == each + columns)
    ]
    return min(gaps, default=0.0)


def _refined(grey: ImageU8, places: npt.NDArray[np.generic], half_px: float) -> Pixels:
    half = round(min(max(half_px, NARROWEST_PX), WIDEST_PX))
    start = np.ascontiguousarray(places.reshape(-1, 2), np.float32)
    found = cv2.cornerSubPix(grey, start, (half, half), (-1, -1), REFINED)
    return np.asarray(found, np.float32).reshape(-1, 2)
