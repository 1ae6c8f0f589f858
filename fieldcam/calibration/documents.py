"""Calibration files as plain mappings, whoever wrote them.

ROS and OpenCV both write YAML that the other one's reader refuses: OpenCV's
begins with `%YAML:1.0` (not YAML's own `%YAML 1.0`) and tags its matrices
`!!opencv-matrix`. Here tags are ignored and every scalar stays a string, so one
parser reads both and nothing in a file can run code or build odd objects.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml

from fieldcam.errors import CalibrationInvalid

LARGEST_FILE_BYTES = 1_000_000
LARGEST_SIDE_PX = 20_000

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
class Document:
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

    def numbers(self, *names: str) -> Array:
        """(N,) float64: a list, a matrix flattened by rows, or one number; all finite."""
        entry = self.entry(*names)
        if isinstance(entry, Mapping):
            entry = entry.get("data")
        items = entry if isinstance(entry, list) else [entry]
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
        for name in ("image_size", "imageSize", "size"):
            if self.has(name):
                size = self.matrix((2,), name)
                return self._checked_size(size[:1], size[1:])
        return None

    def millimetres_per_unit(self) -> float:
        """What one unit of length in this file is; metres unless it says otherwise."""
        if not self.has("units"):
            return MILLIMETRES_PER_UNIT["m"]
        unit = str(self.entry("units")).strip().lower()
        if unit not in MILLIMETRES_PER_UNIT:
            raise self.refuse(f"gives its units as {unit!r}.", "Write m, cm or mm.")
        return MILLIMETRES_PER_UNIT[unit]

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


def read_document(path: Path) -> Document:
    """Parses one calibration file."""
    text = _read_text(path)
    if text.lstrip().startswith("<"):
        raise CalibrationInvalid(f"{path} is XML.", "Save the calibration as .yml.")
    if text.startswith("%YAML"):
        text = text.partition("\n")[2]
    try:
        parsed = yaml.load(text, Loader=yaml.BaseLoader)
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        raise CalibrationInvalid(f"{path} is no YAML file.") from error
    if not isinstance(parsed, dict):
        raise CalibrationInvalid(f"{path} is no calibration file.")
    return Document(path, {str(name): entry for name, entry in parsed.items()})


def _read_text(path: Path) -> str:
    if path.is_dir():
        raise CalibrationInvalid(f"{path} is a folder, not a calibration file.")
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE_BYTES + 1)
    except FileNotFoundError as error:
        raise CalibrationInvalid(f"There is no calibration file {path}.") from error
    except (OSError, ValueError) as error:
        raise CalibrationInvalid(f"{path} cannot be read: {error}.") from error
    if not data.strip():
        raise CalibrationInvalid(f"{path} is empty.")
    if len(data) > LARGEST_FILE_BYTES:
        raise CalibrationInvalid(f"{path} is too large for a calibration file.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CalibrationInvalid(f"{path} is no text file.") from error


def _number(item: object) -> float:
    """NaN for whatever is no number; OpenCV writes `.Nan` and `-.Inf`."""
    if not isinstance(item, str):
        return math.nan
    try:
        return float(item)
    except ValueError:
        return math.nan
