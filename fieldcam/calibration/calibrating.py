"""From pictures of a board to a calibration and all that is to be said about it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from statistics import median

import numpy as np

from fieldcam.calibration.boards import (
    MARKER_FAMILY,
    Board,
    BoardView,
    Kind,
    find_corners,
    match_eyes,
    seen_markers,
)
from fieldcam.calibration.coverage import Coverage, SeenBoard, coverage
from fieldcam.calibration.rectifying import rectified_rig, rows_off_px
from fieldcam.calibration.rig import StereoRig
from fieldcam.calibration.solving import Judged, RawStereo, solve
from fieldcam.errors import CalibrationInvalid
from fieldcam.values import ImageU8

POOR_PX, POOR_ROWS_PX = 0.5, 0.5
"""A good calibration is several times better than that."""


@dataclass(frozen=True, slots=True, eq=False)
class BoardPair:
    """One picture of each eye, not rectified."""

    name: str
    left: ImageU8
    right: ImageU8

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.left.shape[1], self.left.shape[0]


@dataclass(frozen=True, slots=True)
class UnseenBoard:
    """A pair in which the board was not found in both eyes."""

    name: str
    by_left: bool
    """Whether this eye saw any of it."""
    by_right: bool
    markers: str = ""
    """The family of markers in the left picture, where a board has some and was not seen."""

    @property
    def why(self) -> str:
        if self.by_left and self.by_right:
            return "the eyes see too few of the same corners"
        if self.by_left or self.by_right:
            return f"only the {'left' if self.by_left else 'right'} eye sees the board"
        return "neither eye sees the board"


@dataclass(frozen=True, slots=True)
class Looked:
    """What was found in all pairs."""

    views: tuple[BoardView, ...]
    unseen: tuple[UnseenBoard, ...]
    size_px: tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class ViewReport:
    """One view of the board and how well it fits; see Judged."""

    judged: Judged
    rows_px: float
    """Root mean square difference of rows between the rectified eyes."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibrated:
    """A calibrated camera and the evidence for it."""

    board: Board
    camera: RawStereo
    rig: StereoRig
    views: tuple[ViewReport, ...]
    unseen: tuple[UnseenBoard, ...]
    coverage: Coverage
    """Of the views that count."""

    @property
    def kept(self) -> tuple[ViewReport, ...]:
        return tuple(each for each in self.views if not each.judged.why_dropped)

    @property
    def rms_px(self) -> float:
        """Median over views of the worse eye's distance from where corners should be."""
        return median(each.judged.worst_px for each in self.kept)

    @property
    def rows_px(self) -> float:
        """Median over views of the epipolar error."""
        return median(each.rows_px for each in self.kept)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about what makes the result doubtful; none where it is good."""
        return tuple(self._warnings())

    def _warnings(self) -> Iterator[str]:
        if self.rms_px > POOR_PX:
            yield f"Corners are {self.rms_px:.2f} px off: is the board flat, are pictures sharp?"
        if self.rows_px > POOR_ROWS_PX:
            yield f"The eyes' rows are {self.rows_px:.2f} px apart: are the pairs of one moment?"
        missing = self.coverage.missing_words
        if missing:
            yield f"No view has the board {'; '.join(missing)}."


def see(board: Board, pair: BoardPair) -> BoardView | UnseenBoard:
    """The board in one pair."""
    left, right = find_corners(board, pair.left), find_corners(board, pair.right)
    if view := match_eyes(board, pair.name, left, right):
        return view
    by_left, by_right = bool(len(left.ids)), bool(len(right.ids))
    no_board = board.kind is Kind.CHARUCO and not (by_left or by_right)
    return UnseenBoard(pair.name, by_left, by_right, seen_markers(pair.left) if no_board else "")


def look(board: Board, pairs: Iterable[BoardPair]) -> Looked:
    """The board in all pairs, one after the other; raises CalibrationInvalid for mixed sizes."""
    found: list[BoardView | UnseenBoard] = []
    size_px: tuple[int, int] | None = None
    for pair in pairs:
        if size_px is not None and pair.size_px != size_px:
            raise CalibrationInvalid(
                f"{pair.name} has {pair.size_px[0]} x {pair.size_px[1]} pixels,"
                f" the pairs before it {size_px[0]} x {size_px[1]}.",
                "Give pictures of one camera in one setting.",
            )
        size_px = pair.size_px
        found.append(see(board, pair))
    if size_px is None:
        raise CalibrationInvalid("There are no pairs.")
    return Looked(
        tuple(each for each in found if isinstance(each, BoardView)),
        tuple(each for each in found if isinstance(each, UnseenBoard)),
        size_px,
    )


def calibrate(board: Board, looked: Looked) -> Calibrated:
    """The camera that took the pairs; raises CalibrationInvalid where they cannot tell it."""
    if not looked.views:
        _refuse_unseen(board, looked.unseen)
    solution = solve(looked.views, looked.size_px)
    rig = rectified_rig(solution.camera)
    views = tuple(
        ViewReport(judged, float(np.sqrt((rows_off_px(rig, judged.view) ** 2).mean())))
        for judged in solution.views
    )
    seen = [SeenBoard(each.view.left_px, each.view.right_px, each.pose) for each in solution.kept]
    covered = coverage(seen, looked.size_px)
    return Calibrated(board, solution.camera, rig, views, looked.unseen, covered)


def _refuse_unseen(board: Board, unseen: tuple[UnseenBoard, ...]) -> None:
    ever = UnseenBoard("", any(e.by_left for e in unseen), any(e.by_right for e in unseen))
    raise CalibrationInvalid(f"No pair can be used: {ever.why}.", _looked_for(board, unseen))


def _looked_for(board: Board, unseen: tuple[UnseenBoard, ...]) -> str:
    wanted = (
        f"Looked for is a {board.kind} of {board.columns} x {board.rows} squares, not corners;"
        " give another with --board and --squares."
    )
    families = {each.markers for each in unseen if each.markers}
    if not families or families == {MARKER_FAMILY}:
        return wanted
    return (
        f"Its markers are of {' and '.join(sorted(families))}, where {MARKER_FAMILY} is read:"
        " print a board with --print-board, or use a checkerboard."
    )
