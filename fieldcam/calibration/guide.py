"""Tells whoever holds the board what to do next, picture by picture.

The camera is not known yet, so distances and tilts are those of a usual lens: near
enough to say nearer or farther.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcam.calibration.boards import BoardView
from fieldcam.calibration.coverage import Coverage, SeenBoard, coverage
from fieldcam.calibration.poses import usual_pose

ENOUGH_VIEWS = 20
MOVED_SHARE = 0.04
"""Of the picture's width: how far the corners must have moved to make another view."""


@dataclass(frozen=True, slots=True)
class Advice:
    """What one picture was worth."""

    keep: bool
    text: str


class Guide:
    """Collects views until they tell enough."""

    def __init__(self, size_px: tuple[int, int], enough: int = ENOUGH_VIEWS) -> None:
        """`enough` views at least, even where they cover all before."""
        self._size_px, self._enough = size_px, enough
        self._seen: list[SeenBoard] = []

    @property
    def kept(self) -> int:
        return len(self._seen)

    @property
    def coverage(self) -> Coverage:
        return coverage(self._seen, self._size_px)

    @property
    def done(self) -> bool:
        return self.kept >= self._enough and not self.coverage.missing_words

    def consider(self, view: BoardView) -> Advice:
        """Whether the view is worth keeping; it counts from then on."""
        pose = usual_pose(view.board_mm, view.left_px, self._size_px)
        if pose is None:
            return Advice(False, f"The board's place cannot be told. {self.wish}")
        seen = SeenBoard(view.left_px, view.right_px, pose)
        after = coverage([*self._seen, seen], self._size_px)
        adds = len(after.missing_words) < len(self.coverage.missing_words)
        if self._is_known(seen) or not (adds or self.kept < self._enough):
            return Advice(False, f"Nothing new. {self.wish}")
        self._seen.append(seen)
        return Advice(True, f"View {self.kept} kept. {self.wish}")

    @property
    def wish(self) -> str:
        """The sentence that says how to hold the board next."""
        if self.done:
            return "That is enough."
        parts = self.coverage.next_words
        if not parts:
            return f"Hold it in other ways: {self._enough - self.kept} more views."
        return f"Hold the board {', '.join(parts)}."

    def _is_known(self, seen: SeenBoard) -> bool:
        """Whether it is as good as a view that was kept."""
        far_px = MOVED_SHARE * self._size_px[0]
        return any(_moved_px(seen, other) < far_px for other in self._seen)


def _moved_px(seen: SeenBoard, other: SeenBoard) -> float:
    """How far the corners moved; of different ones, how far their outlines did."""
    if seen.left_px.shape == other.left_px.shape:
        return float(np.linalg.norm(seen.left_px - other.left_px, axis=1).mean())
    outlines = ([eye.min(axis=0), eye.max(axis=0)] for eye in (seen.left_px, other.left_px))
    ours, theirs = (np.asarray(outline) for outline in outlines)
    return float(np.linalg.norm(ours - theirs, axis=1).mean())
