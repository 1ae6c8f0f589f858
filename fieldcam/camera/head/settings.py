"""What the operator says about the head, in `camera.toml`; pure but for reading the file."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from fieldcam.errors import CameraSettingsInvalid
from fieldcam.foreign.bounds import CAMERA_SETTINGS
from fieldcam.foreign.files import read_foreign
from fieldcam.user_folders import UserFolder, user_folder

FILE_NAME = "camera.toml"
SOFTWARE = "Software"


class Carrying(StrEnum):
    """How the two eyes' images reach this machine."""

    TWO_DEVICES = "two-devices"
    SIDE_BY_SIDE = "side-by-side"
    STACKED = "stacked"
    ALTERNATING = "alternating"
    """Two blocks of one device for each exposure, the left eye's first."""


@dataclass(frozen=True, slots=True)
class HeadSettings:
    """The defaults suit a head that nobody described yet."""

    left: str | None = None
    """Serial number of the left camera, or of the only one; None: found by `opening`."""
    right: str | None = None
    layout: Carrying | None = None
    """None: told by how many cameras there are, and by their image."""
    leader: str | None = None
    """Serial number of that of two cameras which has the flash and triggers the other one;
    None: the first by serial number, whichever eye it is."""
    exposure_us: float = 300.0
    gain_db: float = 0.0
    white_balance_red: float | None = None
    """Relative to green; None: left as it is."""
    white_balance_blue: float | None = None
    pixel_format: str | None = None
    trigger: str = SOFTWARE
    """Or the line whose edge takes a picture."""
    strobe_line: str = "Line1"
    """Empty: the head fires its flash by itself."""
    strobe_source: str = "ExposureActive"
    """Or a timer, such as Timer0Active."""
    flash_us: float | None = None
    """How long that timer lights the flash."""
    sync_line: str = "Line2"
    """The leader's output that triggers the follower."""
    follower_line: str = "Line2"
    """The follower's input."""
    shutter_line: str = ""
    """The head's own button; empty: it has none."""
    charged_line: str = ""
    """High while the flash is charged; empty: `flash_pause_s` decides."""
    flash_pause_s: float = 0.3
    preview_us: float = 10_000.0
    """The exposure that the preview begins with; it follows the light from there."""
    throughput_bytes_per_s: int | None = None
    """Bounds what each camera sends, where the cable or the port cannot take more."""
    rest_after_s: float = 300.0
    feature_file: Path | None = None
    """GenICam XML, plain or zipped, of cameras whose own cannot be read."""

    @property
    def has_one_camera(self) -> bool:
        """The layout says that one camera carries both eyes."""
        return self.layout not in (None, Carrying.TWO_DEVICES)


def load_settings(data: Path | None) -> HeadSettings:
    """Those of the data folder's file, else of the user's, else the defaults.

    Raises CameraSettingsInvalid.
    """
    for path in settings_paths(data):
        if os.path.lexists(path):
            return parse_settings(read_foreign(path, CAMERA_SETTINGS), str(path))
    return HeadSettings()


def settings_paths(data: Path | None) -> tuple[Path, ...]:
    """Where the file is looked for, the first one that is there counts."""
    user = user_folder(UserFolder.CONFIG)
    folders = (data, None if user is None else user / "fieldcam")
    return tuple(folder / FILE_NAME for folder in folders if folder is not None)


def parse_settings(content: bytes, name: str) -> HeadSettings:
    """`name` is what the sentences of CameraSettingsInvalid call the file."""
    try:
        given = tomllib.loads(content.decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise _refused(name, f"is no proper TOML ({error})") from error
    values: dict[str, Any] = {}
    for key, value in given.items():
        if key not in _KEYS:
            raise _refused(name, f"has {key}, which is none of {', '.join(_KEYS)}")
        reader = _KEYS[key]
        found = reader.read(value)
        if found is None:
            raise _refused(name, f"gives {key} as {value!r}, where {reader.wanted} is needed")
        values[key] = found
    if "feature_file" in values:  # beside camera.toml, where it is a name only
        values["feature_file"] = Path(name).parent / values["feature_file"]
    return _consistent(HeadSettings(**values), name)


@dataclass(frozen=True, slots=True)
class _Key:
    """How one key is read; `read` gives None for what cannot be its value."""

    wanted: str
    read: Callable[[object], Any]


def _number(least: float, most: float, unit: str = "") -> _Key:
    def read(value: object) -> float | None:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return None
        return float(value) if math.isfinite(value) and least <= value <= most else None

    return _Key(f"a number from {least:g} to {most:g}{unit}", read)


def _whole(least: int, most: int) -> _Key:
    def read(value: object) -> int | None:
        plain = isinstance(value, int) and not isinstance(value, bool)
        return value if plain and isinstance(value, int) and least <= value <= most else None

    return _Key(f"a whole number from {least} to {most}", read)


def _text(wanted: str, empty: bool = False) -> _Key:
    def read(value: object) -> str | None:
        return value if isinstance(value, str) and (empty or value) else None

    return _Key(wanted, read)


def _one_of(kind: type[StrEnum]) -> _Key:
    def read(value: object) -> StrEnum | None:
        return next((member for member in kind if member == value), None)

    return _Key(" or ".join(f'"{member}"' for member in kind), read)


_LINE = 'the name of a line such as "Line1"'
_KEYS: Mapping[str, _Key] = {
    "left": _text("a serial number in quotes"),
    "right": _text("a serial number in quotes"),
    "layout": _one_of(Carrying),
    "leader": _text("a serial number in quotes"),
    "exposure_us": _number(1, 1e6, " µs"),
    "gain_db": _number(-50, 100, " dB"),
    "white_balance_red": _number(0.01, 100),
    "white_balance_blue": _number(0.01, 100),
    "pixel_format": _text('a name such as "BayerRG8"'),
    "trigger": _text('"Software" or the name of a line such as "Line0"'),
    "strobe_line": _text(_LINE, empty=True),
    "strobe_source": _text('a name such as "ExposureActive"'),
    "flash_us": _number(1, 1e6, " µs"),
    "sync_line": _text(_LINE),
    "follower_line": _text(_LINE),
    "shutter_line": _text(_LINE, empty=True),
    "charged_line": _text(_LINE, empty=True),
    "flash_pause_s": _number(0, 60, " s"),
    "preview_us": _number(1, 1e6, " µs"),
    "throughput_bytes_per_s": _whole(5_000_000, 10_000_000_000),
    "rest_after_s": _number(1, 1e6, " s"),
    "feature_file": _text("the path of a GenICam XML file"),
}


def _consistent(settings: HeadSettings, name: str) -> HeadSettings:
    if settings.right is not None and settings.left is None:
        raise _refused(name, "names the right camera and not the left one")
    if settings.left is not None and settings.left == settings.right:
        raise _refused(name, f"names {settings.left} as the left and as the right camera")
    if (wrong := _both_ways(settings)) is not None:
        raise _refused(name, f"gives {settings.strobe_line} as strobe_line and as {wrong}")
    if settings.has_one_camera and settings.right is not None:
        raise _refused(name, f"names a right camera, and the layout {settings.layout} has one only")
    return settings


def _both_ways(settings: HeadSettings) -> str | None:
    """The key of an input that the strobe's line is named for too: it can only be one."""
    inputs = ("trigger", "shutter_line", "charged_line")
    same = (key for key in inputs if getattr(settings, key) == settings.strobe_line)
    return next(same, None) if settings.strobe_line else None


def _refused(name: str, what: str) -> CameraSettingsInvalid:
    return CameraSettingsInvalid(f"{name} {what}.", "docs/camera.md shows a whole file.")
