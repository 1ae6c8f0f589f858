"""What the tags of stored readings say about the calibration, as the verdicts take it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median

from fieldcam.calibration.drift import DRIFT_SIZE, size_off, unbiased
from fieldcam.values import TAG_SIZE_MM, ClusterReading

MIN_PICTURES = 3


@dataclass(frozen=True, slots=True)
class TagSizes:
    """What the last pictures say about the camera's calibration."""

    errors: tuple[float, ...]
    """(measured - printed) / printed side, one for each picture that tells."""
    printed_mm: float = TAG_SIZE_MM

    @property
    def measured_mm(self) -> float | None:
        """Median side of the tags as they look, not less the bias; None without a picture."""
        return self.printed_mm * (1 + median(self.errors)) if self.errors else None

    @property
    def drift(self) -> float | None:
        """How far it is off, less the bias; None where too few pictures tell."""
        if len(self.errors) < MIN_PICTURES:
            return None
        return unbiased(median(self.errors))

    @property
    def drifted(self) -> bool:
        """Whether a verdict on a picture of this size would ask for a look."""
        return self.drift is not None and size_off(median(self.errors)) > DRIFT_SIZE


def tag_sizes(readings: Iterable[ClusterReading]) -> TagSizes:
    """The check over some readings, the newest first: of cards of that one's size."""
    known = [each for each in readings if each.tag_size_error is not None]
    printed_mm = known[0].settings.tag_size_mm if known else TAG_SIZE_MM
    same = (each for each in known if each.settings.tag_size_mm == printed_mm)
    errors = (each.tag_size_error for each in same)
    return TagSizes(tuple(error for error in errors if error is not None), printed_mm)
