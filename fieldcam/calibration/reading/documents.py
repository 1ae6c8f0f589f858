"""One calibration file's entries, by whichever of their names its program uses."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fieldcam.errors import CalibrationInvalid

CALIBRATION_NAMES = ("calibration.yml", "calibration.yaml")
"""Of the one file that describes both eyes; the first is written."""
LARGEST_SIDE_PX = 20_000
UNITS = re.compile(r"(?:([0-9]{1,9}(?:\.[0-9]{1,9})?) ?)?([a-z]{1,20})", re.ASCII)

MILLIMETRES_PER_UNIT = {
    "m": 1000.0,
    "metre": 1000.0,
    "metres": 1000.0,
    "meter": 1000.0,
    "meters": 1000.0,
    "cm": 10.0,
    "mm": 1.0,
    "millimetre": 1.0,
    "millimetres": 1.0,
    "millimeter": 1.0,
    "millimeters": 1.0,
}

SERIALS = ("left_serial", "right_serial")
"""Which cameras a file describes, where it says so."""

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CalibrationDocument:
    """One calibration file's top level; every scalar is still a string."""

    path: Path
    entries: Mapping[str, object]

    def has(self, *names: str) -> bool:
        return any(name in self.entries for name in names)

    def refuse(self, sentence: str, hint: str = "") -> CalibrationInvalid:
        """The error for this file: `sentence` goes on after its name."""
        return CalibrationInvalid(f"{self.path} {sentence}", hint)

    def entry(self, *names: str) -> object:
        """The entry under the first of `names` that is there."""
        for name in names:
            if name in self.entries:
                return self.entries[name]
        raise self.refuse(f"has no entry {' or '.join(names)}.")

    def part(self, name: str) -> CalibrationDocument:
        """A mapping inside it, as a document of its own."""
        entry = self.entry(name)
        if not isinstance(entry, Mapping):
            raise self.refuse(f"has an entry {name} that holds no named entries.")
        return CalibrationDocument(self.path, entry)

    def text(self, name: str) -> str:
        """The text under `name`; empty where there is none."""
        entry = self.entries.get(name, "")
        if not isinstance(entry, str):
            raise self.refuse(f"has a list under {name}, where a word is needed.")
        return entry.strip()

    def numbers(self, *names: str) -> Array:
        """(N,) float64: a list, a matrix or list of rows, row by row, or one number; all finite."""
        entry = self.entry(*names)
        if isinstance(entry, Mapping):
            entry = entry.get("data")
        rows = entry if isinstance(entry, list) else [entry]
        items = [item for row in rows for item in (row if isinstance(row, list) else [row])]
        values = np.array([_number(item) for item in items], dtype=np.float64)
        if not np.isfinite(values).all():
            raise self.refuse(f"has an entry {names[0]} that is not made of finite numbers.")
        return values

    def matrix(self, shape: tuple[int, ...], *names: str) -> Array:
        """Float64 of this shape."""
        values = self.numbers(*names)
        if values.size != math.prod(shape):
            raise self.refuse(
                f"has {values.size} numbers under {names[0]} where {math.prod(shape)} are needed."
            )
        return values.reshape(shape)

    def rotation(self, *names: str) -> Array:
        """(3, 3) float64, checked to be a rotation."""
        rotation = self.matrix((3, 3), *names)
        deviation = np.abs(rotation @ rotation.T - np.eye(3)).max()
        if deviation > 1e-3 or np.linalg.det(rotation) < 0:
            raise self.refuse(f"has an entry {names[0]} that is no rotation.")
        return rotation

    def size_px(self) -> tuple[int, int] | None:
        """Width and height, or None where the file does not say."""
        for width, height in (("image_width", "image_height"), ("width", "height")):
            if self.has(width) and self.has(height):
                return self._checked_size(self.numbers(width), self.numbers(height))
        for name in ("image_size", "imageSize", "size", "resolution"):
            if self.has(name):
                size = self.matrix((2,), name)
                return self._checked_size(size[:1], size[1:])
        return None

    def millimetres_per_unit(self) -> float:
        """What one unit of length in this file is; metres unless it says otherwise.

        Where lengths are in squares of a board, it says how long one is: `units: 25 mm`.
        """
        said = self.text("units").lower()
        written = UNITS.fullmatch(said or "m")
        count, unit = written.groups() if written else (None, said)
        known = MILLIMETRES_PER_UNIT.get(unit, math.nan) * float(count or 1)
        if not (math.isfinite(known) and known > 0):
            raise self.refuse(
                f"gives its units as {said[:40]!r}.",
                "Write m, cm or mm, or how long one unit is, such as 25 mm.",
            )
        return known

    def serials(self) -> tuple[str, str] | None:
        """Of the left and the right eye, or None where the file does not say."""
        left, right = (self.entries.get(key) for key in SERIALS)
        return (left, right) if isinstance(left, str) and isinstance(right, str) else None

    def _checked_size(self, width: Array, height: Array) -> tuple[int, int]:
        if width.size != 1 or height.size != 1:
            raise self.refuse("gives its image size as a list.")
        size = int(width[0]), int(height[0])
        if not all(0 < side <= LARGEST_SIDE_PX for side in size):
            raise self.refuse(f"gives an impossible image size of {size[0]} x {size[1]} pixels.")
        return size


def _number(item: object) -> float:
    """NaN for whatever is no number; OpenCV writes `.Nan` and `-.Inf`."""
    if not isinstance(item, str):
        return math.nan
    try:
        return float(item)
    except ValueError:
        return math.nan
