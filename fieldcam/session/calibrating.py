"""The calibration of the head in use: each of its pictures is stored with it.

A picture that was taken before there was one waits, and is read with the first one that
comes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from fieldcam.calibration.reading.readers import load_camera
from fieldcam.calibration.reading.sources import open_documents
from fieldcam.calibration.rectified_file import rectified_file
from fieldcam.errors import CalibrationInvalid, FieldcamError, StorageError
from fieldcam.foreign.bounds import CALIBRATION
from fieldcam.foreign.files import read_foreign
from fieldcam.store.calibrations import calibration_in_use
from fieldcam.store.captures import SavedCapture
from fieldcam.store.store import Store
from fieldcam.values import Calibration

MISSING = (
    "The camera is not calibrated yet: pictures are saved, and read once `fieldcam calibrate`"
    " was run."
)

Version = tuple[Path, int, int]
"""A file's path, time of change in ns, and size."""


@dataclass(frozen=True, slots=True)
class Found:
    """What is known of the newest calibration."""

    name: str | None = None
    """Of the kept file; None where there is none that can be used."""
    problem: str = ""
    serials: tuple[str, str] | None = None
    """Of the left and the right eye that it is of, where it says so."""


class OwnCalibration:
    """The data folder's newest calibration, looked at anew for each picture; any thread may ask."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._version: Version | None = None
        self._found = Found(problem=MISSING)

    @property
    def name(self) -> str | None:
        """Of the kept file; None where there is none that can be used."""
        return self._look().name

    @property
    def problem(self) -> str:
        """Why pictures wait; empty where they need not."""
        return self._look().problem

    @property
    def file(self) -> Path | None:
        """The kept file, which never changes."""
        name = self.name
        return None if name is None else self._store.objects.path(name)

    def doubt(self, serials: tuple[str, str]) -> str:
        """Why it may not fit the head whose left and right eye these are; empty where it does."""
        own = self._look().serials
        if own is None or own == serials:
            return ""
        if own == serials[::-1]:
            return "Left and right were swapped since the camera was calibrated: do it again."
        return (
            f"The calibration is of another head, {' and '.join(own)}: sizes will be wrong"
            " until `fieldcam calibrate` was run with this one."
        )

    def completed(self, saved: SavedCapture) -> SavedCapture | None:
        """A picture that can be read: with its own calibration, else with this one."""
        if saved.calibration is not None:
            return saved
        file = self.file
        return None if file is None else replace(saved, calibration=file)

    def _look(self) -> Found:
        try:
            path = calibration_in_use(self._store.folder.path)
            version = None if path is None else _version(path)
            if version != self._version:
                self._found = self._judged(path)
                self._version = version
        except StorageError as error:
            return Found(problem=_waiting(error))
        return self._found

    def _judged(self, path: Path | None) -> Found:
        content = None if path is None else _read(path)
        if path is None or content is None:
            return Found(problem=MISSING)
        try:
            load_camera(path)
            named = (document.serials() for document in open_documents(path).values())
            serials = next((each for each in named if each is not None), None)
        except CalibrationInvalid as error:
            return Found(problem=_waiting(error))
        return Found(self._store.keep_calibration(content), serials=serials)


@dataclass(frozen=True, slots=True)
class KnownCalibration:
    """That of a camera which is known beforehand, such as a simulated one."""

    name: str
    """Of the kept file."""
    file: Path
    problem: str = ""

    def doubt(self, serials: tuple[str, str]) -> str:
        """It fits whatever head there is."""
        return ""

    def completed(self, saved: SavedCapture) -> SavedCapture:
        """With its own calibration, else with this one."""
        return saved if saved.calibration is not None else replace(saved, calibration=self.file)


CameraCalibration = OwnCalibration | KnownCalibration


def keep_known(store: Store, camera: Calibration | Path | None) -> KnownCalibration | None:
    """Keep what describes a camera in one file; None where nothing does, or only a folder."""
    if isinstance(camera, Calibration):
        content: bytes | None = rectified_file(camera)
    else:
        content = None if camera is None else _read(camera)
    if content is None:
        return None
    name = store.keep_calibration(content)
    return KnownCalibration(name, store.objects.path(name))


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
        return read_foreign(path, CALIBRATION)
    except CalibrationInvalid:
        return None
