"""From views of a board to a stereo camera, with what each view says about it.

Each eye is solved alone, then both together, which also says where they stand. Views
that the others contradict are dropped, and the rest is solved again, until all agree:
one picture in which the board moved would otherwise bend the whole camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from statistics import median

import cv2
import numpy as np

from fieldcam.calibration.boards import BoardView, Pixels
from fieldcam.calibration.fisheye import fits_fisheye
from fieldcam.calibration.poses import BoardPose, board_pose, find_pose, usual_pose
from fieldcam.calibration.reading.documents import Array
from fieldcam.errors import CalibrationInvalid

MIN_VIEWS = 8
TURNED_DEG = 12.0
"""Between the two views that are tilted most differently; from less no focal length comes."""
FLOOR_PX, TIMES_MEDIAN = 0.3, 3.0
"""A view is dropped above both: so many pixels, and so many times what is usual here."""
MAX_ROUNDS = 10
ROUGH_PX = 1.5
"""No camera is that far from its views in the middle, unless they contradict each other."""
DOUBTFUL_PX, GOOD_PX = 0.4, 0.25
"""Of a usual lens, corners of a stereo view, and of one eye alone, lie nearer to where they
should be."""
UNSURE_FOCAL = 0.01
"""Of the focal length: its standard deviation, beyond which nothing is known."""
FLAT_AND_PAIRED = "Is the board flat and glued to something stiff, and are the pairs of one moment?"
# Three radial terms cannot be told apart in a lens of 45 degrees: the third takes what
# the others should have.
LENS_FLAGS = cv2.CALIB_FIX_K3
BOTH_FLAGS = LENS_FLAGS | cv2.CALIB_USE_INTRINSIC_GUESS
ENDED = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 30, 1e-7)


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """One eye before anything is rectified."""

    camera_matrix: Array
    """(3, 3), px."""
    distortion: Array
    """(5,): k1, k2, p1, p2, k3 of the plumb-bob model."""
    focal_sigma_px: float
    """Standard deviation of the focal length, as the eye's own views give it."""


@dataclass(frozen=True, slots=True, eq=False)
class RawStereo:
    """Two lenses and where they stand."""

    left: Lens
    right: Lens
    rotation: Array
    """(3, 3): a point of the left eye's frame is rotation @ point + translation in the right's."""
    translation_mm: Array
    """(3,)"""
    size_px: tuple[int, int]
    """Width and height."""

    @property
    def baseline_mm(self) -> float:
        return float(np.linalg.norm(self.translation_mm))


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """One view and how well it fits the camera."""

    view: BoardView
    pose: BoardPose
    """In the left eye's frame."""
    left_rms_px: float
    right_rms_px: float
    why_dropped: str = ""
    """A sentence; empty where the view counted."""

    @property
    def worst_px(self) -> float:
        return max(self.left_rms_px, self.right_rms_px)


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The camera, and every view in the order it came."""

    camera: RawStereo
    views: tuple[Judged, ...]

    @property
    def kept(self) -> tuple[Judged, ...]:
        return tuple(each for each in self.views if not each.why_dropped)


def solve(views: Sequence[BoardView], size_px: tuple[int, int]) -> Solution:
    """The stereo camera that took these views of one board.

    Raises CalibrationInvalid where they are too few, too much alike, or do not agree, and
    where the lens is one that no more pictures would help, as a fisheye.
    """
    _check_variety(views, size_px)
    try:
        found = _solve_agreeing(views, size_px)
    except CalibrationInvalid as error:
        if _is_fisheye(views, size_px):
            raise _fisheye() from error
        raise
    if median(each.worst_px for each in found.kept) > DOUBTFUL_PX and _is_fisheye(views, size_px):
        raise _fisheye()
    return found


def _is_fisheye(views: Sequence[BoardView], size_px: tuple[int, int]) -> bool:
    boards, left = [view.board_mm for view in views], [view.left_px for view in views]
    try:
        rms_px, *_ = cv2.calibrateCamera(
            boards, left, size_px, np.eye(3), np.zeros(5), flags=LENS_FLAGS, criteria=ENDED
        )
    except cv2.error:
        return False
    return rms_px > GOOD_PX and fits_fisheye(boards, left, size_px, rms_px)


def _fisheye() -> CalibrationInvalid:
    return CalibrationInvalid(
        "The lens bends its picture as a fisheye does, which cannot be calibrated here.",
        "More pictures do not help: use a lens of a narrower view.",
    )


def _solve_agreeing(views: Sequence[BoardView], size_px: tuple[int, int]) -> Solution:
    kept = tuple(range(len(views)))
    for _ in range(MAX_ROUNDS):
        camera, judged = _solve_and_judge(views, kept, size_px)
        limit_px = max(FLOOR_PX, TIMES_MEDIAN * median(judged[i].worst_px for i in kept))
        agreeing = tuple(i for i, each in enumerate(judged) if each.worst_px <= limit_px)
        if agreeing == kept:
            break
        _check_count(len(agreeing), len(views))
        kept = agreeing
    _check_camera(camera, median(judged[i].worst_px for i in kept))
    dropped = set(range(len(views))) - set(kept)
    return Solution(
        camera,
        tuple(
            replace(each, why_dropped=_why(camera, each.view, limit_px)) if i in dropped else each
            for i, each in enumerate(judged)
        ),
    )


def _check_variety(views: Sequence[BoardView], size_px: tuple[int, int]) -> None:
    _check_count(len(views), len(views))
    poses = (usual_pose(view.board_mm, view.left_px, size_px) for view in views)
    normals = [pose.normal for pose in poses if pose is not None]
    least = min((float(a @ b) for a, b in combinations(normals, 2)), default=1.0)
    if least > np.cos(np.radians(TURNED_DEG)):
        raise CalibrationInvalid(
            "The board is tilted the same way in all views.",
            "Tilt it by 20 to 40 degrees, another edge nearer to the camera each time.",
        )


def _check_count(agreeing: int, of: int) -> None:
    if agreeing >= MIN_VIEWS:
        return
    if of >= MIN_VIEWS:
        raise CalibrationInvalid(
            f"Only {agreeing} of {of} views agree with each other; {MIN_VIEWS} are needed.",
            FLAT_AND_PAIRED,
        )
    raise CalibrationInvalid(
        f"Both eyes see the board in {of} of the pairs; {MIN_VIEWS} are needed, 20 are good.",
        "Take more pictures in which both eyes see it.",
    )


def _solve_and_judge(
    views: Sequence[BoardView], kept: Sequence[int], size_px: tuple[int, int]
) -> tuple[RawStereo, list[Judged]]:
    """The camera by some of the views, and what all of them are by it."""
    camera, poses = _solve_all([views[i] for i in kept], size_px)
    known = dict(zip(kept, poses, strict=True))
    return camera, [
        _judged(camera, view, known.get(i) or _pose(camera.left, view.board_mm, view.left_px))
        for i, view in enumerate(views)
    ]


def _solve_all(
    views: Sequence[BoardView], size_px: tuple[int, int]
) -> tuple[RawStereo, tuple[BoardPose, ...]]:
    """The camera by these views, all of which count, and the board's pose in each."""
    boards = [view.board_mm for view in views]
    eyes = [view.left_px for view in views], [view.right_px for view in views]
    try:
        left, right = (_solve_lens(boards, places, size_px) for places in eyes)
        _, k1, d1, k2, d2, rotation, translation, _, _, turns, moves, _ = (
            cv2.stereoCalibrateExtended(
                boards, *eyes, left.camera_matrix, left.distortion, right.camera_matrix,
                right.distortion, size_px, np.eye(3), np.zeros((3, 1)),
                flags=BOTH_FLAGS, criteria=ENDED,
            )
        )  # fmt: skip
    except cv2.error as error:
        raise _unsolved() from error
    camera = RawStereo(
        _lens(k1, d1, left.focal_sigma_px),
        _lens(k2, d2, right.focal_sigma_px),
        np.asarray(rotation, np.float64),
        np.asarray(translation, np.float64).reshape(3),
        size_px,
    )
    poses = zip(boards, turns, moves, strict=True)
    return camera, tuple(board_pose(b, np.asarray(t), np.asarray(m)) for b, t, m in poses)


def _solve_lens(
    boards: Sequence[Pixels], places: Sequence[Pixels], size_px: tuple[int, int]
) -> Lens:
    """One eye alone."""
    _, matrix, distortion, _, _, sigmas, _, _ = cv2.calibrateCameraExtended(
        boards, places, size_px, np.eye(3), np.zeros(5), flags=LENS_FLAGS, criteria=ENDED
    )
    return _lens(matrix, distortion, float(np.ravel(sigmas)[0]))


def _lens(matrix: object, distortion: object, focal_sigma_px: float) -> Lens:
    own = np.asarray(matrix, np.float64), np.asarray(distortion, np.float64).ravel()
    if not all(np.isfinite(numbers).all() for numbers in own):
        raise _unsolved()
    return Lens(*own, focal_sigma_px)


def _unsolved() -> CalibrationInvalid:
    return CalibrationInvalid(
        "No camera explains these views.",
        "Are the numbers of squares right, and is the board tilted another way in each view?",
    )


def _check_camera(camera: RawStereo, rms_px: float) -> None:
    """Whether the numbers are worth anything."""
    if rms_px > ROUGH_PX:
        raise CalibrationInvalid(
            f"The views contradict each other: corners are {rms_px:.1f} px off at best.",
            FLAT_AND_PAIRED,
        )
    for name, lens in (("left", camera.left), ("right", camera.right)):
        focal_px = float(lens.camera_matrix[0, 0])
        if lens.focal_sigma_px > UNSURE_FOCAL * focal_px:
            raise CalibrationInvalid(
                f"The {name} eye's focal length, {focal_px:.0f} px, is known only to"
                f" {lens.focal_sigma_px:.0f} px.",
                "Take more pictures, with the board tilted by 20 to 40 degrees.",
            )


def _judged(camera: RawStereo, view: BoardView, pose: BoardPose) -> Judged:
    right = BoardPose(
        camera.rotation @ pose.turn,
        camera.rotation @ pose.place_mm + camera.translation_mm,
        camera.rotation @ pose.middle_mm + camera.translation_mm,
    )
    return Judged(
        view,
        pose,
        _rms_px(camera.left, view.board_mm, view.left_px, pose),
        _rms_px(camera.right, view.board_mm, view.right_px, right),
    )


def _why(camera: RawStereo, view: BoardView, limit_px: float) -> str:
    """What may be wrong with a view that did not count: each eye's corners tell by themselves."""
    eyes = (camera.left, view.left_px), (camera.right, view.right_px)
    for lens, places in eyes:
        pose = _pose(lens, view.board_mm, places)
        if _rms_px(lens, view.board_mm, places, pose) > limit_px:
            return "the corners fit no flat board: blurred, hidden or bent"
    return "the eyes saw the board at different places: not of one moment"


def _pose(lens: Lens, board_mm: Pixels, places_px: Pixels) -> BoardPose:
    pose = find_pose(board_mm, places_px, lens.camera_matrix, lens.distortion)
    if pose is None:
        raise _unsolved()
    return pose


def _rms_px(lens: Lens, board_mm: Pixels, places_px: Pixels, pose: BoardPose) -> float:
    """Root mean square distance between where corners are and where they should be."""
    expected, _ = cv2.projectPoints(
        board_mm, cv2.Rodrigues(pose.turn)[0], pose.place_mm, lens.camera_matrix, lens.distortion
    )
    off = np.asarray(expected, np.float64).reshape(-1, 2) - places_px
    return float(np.sqrt((off**2).sum(axis=1).mean()))
