"""Small pictures to aim by."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.values import ImageU8


@dataclass(frozen=True, slots=True, eq=False)
class Preview:
    """What the left eye sees while the operator aims."""

    left: ImageU8
    """(h, w) grey or (h, w, 3) RGB."""
    shrunk: int
    """Full-size pixels to a pixel of `left`, whose first one lies at the first of these."""
    flash_ready: bool
