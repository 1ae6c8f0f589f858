"""What a file from elsewhere may cost to read; every reader takes its bounds from here."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.errors import (
    BadInput,
    CalibrationInvalid,
    CameraSettingsInvalid,
    FeatureFileInvalid,
    ImageUnreadable,
)

MIB = 2**20


@dataclass(frozen=True, slots=True)
class Bound:
    """One kind of file."""

    what: str
    """For sentences, as in "a folder, not a calibration file"."""
    most_bytes: int
    refusal: type[BadInput] = BadInput
    most_cpu_s: int = 5
    """Of a reader in a process of its own; the interpreter's start is part of it."""
    most_memory_bytes: int = 400 * MIB
    """Of the same."""

    def refuse(self, sentence: str, hint: str = "") -> BadInput:
        """The error that readers of this kind raise."""
        return self.refusal(sentence, hint)


CALIBRATION = Bound("calibration file", MIB, CalibrationInvalid)
TARBALL = Bound("calibration file", 512 * MIB, CalibrationInvalid)
"""With the pictures that it was made from."""
HEAD = Bound("file about a head", MIB)
CAMERA_SETTINGS = Bound("file of camera settings", MIB, CameraSettingsInvalid)
FEATURES = Bound("feature file", 16 * MIB, FeatureFileInvalid)
"""GenICam XML, packed or unpacked; the largest seen has 4 MiB."""
IMAGE = Bound("image", 256 * MIB, ImageUnreadable)
TABLE = Bound("table", 16 * MIB)
WORKBOOK = Bound("workbook", 16 * MIB, most_cpu_s=2)

MOST_PIXELS = 50_000_000
"""Of one picture; a stereo head's has 1.6 million, a telephone's up to 50 million."""

MOST_YAML_PARTS = 50_000
"""Scalars, lists and mappings of a calibration, each use of an alias counted."""
DEEPEST_YAML = 20

MOST_ELEMENTS = 250_000
"""Of a feature file, structures spelt out; the largest seen has 29,000."""
DEEPEST_ELEMENTS = 32
