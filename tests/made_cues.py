"""Cues made up for tests of what is done with cues."""

from __future__ import annotations

from dataclasses import replace

from fieldcam.session.aim.cue import Cue
from made_readings import TAG

from fieldcam.values import TagPose


def tag(tag_id: int, range_mm: float = 440.0) -> TagPose:
    return replace(TAG, id=tag_id, translation_mm=(0.0, 50.0, range_mm))


def good_cue(due: int, range_mm: float = 440.0) -> Cue:
    return Cue(due, (due,), tag(due, range_mm).translation_mm, moved_mm=2.0, flash_ready=True)
