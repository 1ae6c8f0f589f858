"""The calibrations of a data folder's camera: `calibrations/<number>-<day>/`.

None is ever changed or written over; the one with the highest number is in use. It is
a number because a laptop's clock may be wrong.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import date
from pathlib import Path

from fieldcam.calibration.reading.documents import CALIBRATION_NAMES
from fieldcam.errors import StorageError

FOLDER_NAME = "calibrations"
NUMBERED = re.compile(r"(\d{4,})-\d{4}-\d{2}-\d{2}", re.ASCII)


def next_calibration(data: Path, day: date) -> Path:
    """The folder that a calibration made on this day goes to; it is not there yet."""
    number = max((number for number, _ in _numbered(data)), default=0) + 1
    return data / FOLDER_NAME / f"{number:04d}-{day.isoformat()}"


def calibration_in_use(data: Path) -> Path | None:
    """The newest calibration's file of both eyes; None where the camera was never calibrated."""
    files = ((number, path / CALIBRATION_NAMES[0]) for number, path in _numbered(data))
    newest = max((each for each in files if each[1].is_file()), default=None)
    return None if newest is None else newest[1]


def _numbered(data: Path) -> Iterator[tuple[int, Path]]:
    folder = data / FOLDER_NAME
    try:
        members = list(folder.iterdir()) if folder.is_dir() else []
    except OSError as error:
        raise StorageError(f"{folder} cannot be read: {error.strerror}.") from error
    for path in members:
        if match := NUMBERED.fullmatch(path.name):
            yield int(match[1]), path
