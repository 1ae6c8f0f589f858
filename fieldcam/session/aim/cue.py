"""What tells the operator that the camera is aimed right; pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import dist

from fieldcam.values import FARTHEST_MM, NEAREST_MM, TagPose

MAX_MOVED_MM = 8.0
"""Between two previews, half a second apart: the flash itself freezes far more."""


class Zone(StrEnum):
    """Where the tag is against the working range."""

    NEAR = "near"
    GOOD = "good"
    FAR = "far"


@dataclass(frozen=True, slots=True)
class Cue:
    """One look at the scene."""

    due: int | None
    """The tag of the cluster where the operator stands; None: a new one is to be learned."""
    read: tuple[int, ...] = ()
    """All tags in view."""
    place_mm: tuple[float, float, float] | None = None
    """Of the due tag's centre in the camera frame; None unless it is in view once."""
    moved_mm: float | None = None
    """Since the look before; None where one of the two lacks the tag or its range."""
    flash_ready: bool = False
    problem: str = ""
    """Why it is not known which tags are in view; empty where it is."""

    @property
    def range_mm(self) -> float | None:
        return None if self.place_mm is None else self.place_mm[2]

    @property
    def in_view(self) -> bool:
        """The due tag is read, and only once; where none is due, any one tag alone."""
        return len(self.read) == 1 if self.due is None else self.read.count(self.due) == 1

    @property
    def zone(self) -> Zone | None:
        if self.range_mm is None:
            return None
        if self.range_mm < NEAREST_MM:
            return Zone.NEAR
        return Zone.FAR if self.range_mm > FARTHEST_MM else Zone.GOOD

    @property
    def still(self) -> bool | None:
        return None if self.moved_mm is None else self.moved_mm <= MAX_MOVED_MM

    @property
    def ready(self) -> bool:
        """Tag, range, stillness and flash are right."""
        return self.zone is Zone.GOOD and self.still is True and self.flash_ready


def cue_of(due: int | None, tags: Sequence[TagPose], before: Cue | None, flash_ready: bool) -> Cue:
    """The cue of the tags in view; `before` is that of the look before."""
    poses = [tag for tag in tags if due in (None, tag.id)]
    place_mm = poses[0].translation_mm if len(poses) == 1 else None
    last_mm = before.place_mm if before is not None and before.due == due else None
    moved_mm = None if last_mm is None or place_mm is None else dist(last_mm, place_mm)
    return Cue(due, tuple(sorted(tag.id for tag in tags)), place_mm, moved_mm, flash_ready)
