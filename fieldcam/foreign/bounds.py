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
    """For sentences, as in "There is no calibration file …"."""
    most_bytes: int
    refusal: type[BadInput] = BadInput
    most_cpu_s: int = 5
    """Of a reader in a process of its own; the interpreter's start is part of it."""
    most_memory_bytes: int = 400 * MIB
    """Of the same."""

    @property
    def one(self) -> str:
        """With its article."""
        return f"{'an' if self.what[0] in 'aeiou' else 'a'} {self.what}"

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
IMAGE = Bound("image", 128 * MIB, ImageUnreadable)
TABLE = Bound("table", 64 * MIB)
"""The largest that anybody measured has some 10,000 rows."""

MAX_PIXELS = 25_000_000
"""Of one picture; a stereo head's has 1.6 million. Outlining fruit in so many takes 2.4 GB."""
MAX_IMAGE_PARTS = 100_000
"""Chunks of a PNG, segments of a JPEG; 10,000 are many."""
MAX_JPEG_SCANS = 100
"""Each is a pass over all pixels; a progressive picture has about ten."""
LONGEST_PNM_HEADER_BYTES = 4096

MAX_YAML_PARTS = 50_000
"""Scalars, lists and mappings of a calibration, each use of an alias counted."""
DEEPEST_YAML = 20

MAX_ELEMENTS = 100_000
"""Of a feature file, structures spelt out; the largest seen has 29,000."""
DEEPEST_ELEMENTS = 32
LONGEST_FORMULA, MAX_FORMULA_TEXT = 20_000, 500_000
"""Characters, of one and of all; the longest one seen in a camera's file has 2,052."""
MAX_VISITS = 100_000
"""Of a feature file's nodes, for one answer; the hungriest feature seen takes 1,141."""
MAX_LISTING_CPU_S = 3.0
"""For a list of all features; a camera's takes half a second."""

MAX_TEXT_BYTES = 16 * MIB
"""Of a CSV table."""
MAX_UNPACKED_BYTES = 64 * MIB
"""Of all parts of a workbook together."""
MAX_ROWS = 200_000
"""Of a table, that hold something."""
LAST_ROW = 1_048_576
"""Of a sheet; spreadsheet programs end there."""
MAX_CELLS = 2_000_000
"""Of a sheet, empty ones before a filled one counted."""
MAX_SHEETS = 400
"""A day of the year each, and a few more."""
MAX_TITLE_ROWS = 20
"""That may stand above a table's heading."""
MAX_FRUITS = 30_000
"""Of a caliper table: 4,000 clusters take seconds, and room grows with their number."""
MAX_ELEMENTS = 500_000
"""Of a workbook's XML; 10,000 rows of 12 cells are 250,000, which take seconds."""
MAX_HOLLOW_ELEMENTS = 100_000
"""Of these, such as hold nothing: rows and cells that were only formatted."""
DEEPEST_ELEMENTS = 32
