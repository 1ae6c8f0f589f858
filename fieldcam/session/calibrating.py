"""The calibration of the head in use: each of its pictures is stored with it.

A picture that was taken before there was one waits, and is read with the first one that
comes.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fieldcam.calibration.readers import load_camera
from fieldcam.errors import CalibrationInvalid, FieldcamError, StorageError
from fieldcam.store.calibrations import calibration_in_use
from fieldcam.store.captures import SavedCapture
from fieldcam.store.store import Store

MISSING = (
    "The camera is not calibrated yet: pictures are saved, and read once `fieldcam calibrate`"
    " was run."
)

Version = tuple[Path, int, int]
"""A file's path, time of change in ns, and size."""


class OwnCalibration:
    """The data folder's newest calibration, looked at anew for each picture; any thread may ask."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._known: tuple[Version | None, str | None, str] = None, None, MISSING

    @property
    def name(self) -> str | None:
        """Of the kept file; None where there is none that can be used."""
        return self._look()[1]

    @property
    def problem(self) -> str:
        """Why pictures wait; empty where they need not."""
        return self._look()[2]

    @property
    def file(self) -> Path | None:
        """The kept file, which never changes."""
        name = self.name
        return None if name is None else self._store.objects.path(name)

    def completed(self, saved: SavedCapture) -> SavedCapture | None:
        """A picture that can be read: with its own calibration, else with this one."""
        if saved.calibration is not None:
            return saved
        file = self.file
        return None if file is None else replace(saved, calibration=file)

    def _look(self) -> tuple[Version | None, str | None, str]:
        try:
            return self._known_anew()
        except StorageError as error:
            return None, None, _waiting(error)

    def _known_anew(self) -> tuple[Version | None, str | None, str]:
        path = calibration_in_use(self._store.folder.path)
        version = None if path is None else _version(path)
        if version != self._known[0]:
            self._known = (version, *self._judged(path))
        return self._known

    def _judged(self, path: Path | None) -> tuple[str | None, str]:
        content = None if path is None else _read(path)
        if path is None or content is None:
            return None, MISSING
        try:
            load_camera(path)
        except CalibrationInvalid as error:
            return None, _waiting(error)
        return self._store.keep_calibration(content), ""


def _waiting(error: FieldcamError) -> str:
    return f"Pictures are saved and wait: {error}"


def _version(path: Path) -> Version | None:
    """Another one when the file is another: each key press asks, and need not read it."""
    try:
        found = path.stat()
    except OSError:
        return None
    return path, found.st_mtime_ns, found.st_size


def _read(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None
