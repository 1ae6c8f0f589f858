"""What can be wrong with a capture, on command and at five severities."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Spoiling(StrEnum):
    """One way to spoil a pair."""

    NONE = "none"
    DARK = "dark"
    OVEREXPOSED = "overexposed"
    BLURRED = "blurred"
    DEFOCUSED = "defocused"
    TOO_NEAR = "too_near"
    TOO_FAR = "too_far"
    CUT_BY_BORDER = "cut_by_border"
    SWAPPED_EYES = "swapped_eyes"
    MISPAIRED = "mispaired"
    DRIFTED = "drifted"
    TAG_HIDDEN = "tag_hidden"


SEVERITIES = (1, 2, 3, 4, 5)


@dataclass(frozen=True, slots=True)
class Faults:
    """A fault and how bad it is: 1 can just be told, 5 cannot be missed."""

    kind: Spoiling = Spoiling.NONE
    severity: int = 5
