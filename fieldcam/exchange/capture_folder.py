"""Reads a folder of captures, in fieldcam's own layout or in the authors' tree.

Own: `DIR/<YYYY-MM-DD>/<tag>_<n>_left.png` with `…_right.png`, n counting the
views; `calibration.yml` in the day's folder, else in DIR.

Authors': `DIR/<tag>_<YYYY-MM-DD-HH-MM-SS>/COLOR/*LEFT*.png` with the same name in
RIGHT; calibrations `<YYYY_MM_DD>.yml` in DIR or in DIR/camera_info.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import date, datetime, time, timedelta
from pathlib import Path

from fieldcam.calibration.reading.documents import CALIBRATION_NAMES
from fieldcam.errors import BadInput
from fieldcam.exchange.checksums import Checksums, is_list, read_checksums
from fieldcam.values import HIGHEST_TAG_ID

DAY_FOLDER = re.compile(r"[12]\d{3}-\d{2}-\d{2}", re.ASCII)
VIEW_FILE = re.compile(r"(\d{1,6})_0*([1-9]\d{0,5})_(left|right)", re.ASCII | re.IGNORECASE)
RECORDING_FOLDER = re.compile(r"(\d{1,6})_([12]\d{3}(?:-\d{2}){5})", re.ASCII)
DATED_CALIBRATION = re.compile(r"\d{4}_\d{2}_\d{2}", re.ASCII)

IMAGE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".pgm", ".ppm"})
CALIBRATION_FOLDER = "camera_info"

NO_CHECKSUMS = Checksums()
DAY_STARTS_AT_HOUR = 4
"""The authors recorded by night; before this hour it is still the day before."""


@dataclass(frozen=True, slots=True, order=True)
class CaptureFile:
    """One stereo pair of files."""

    day: date
    tag_id: int
    view: int
    """Counts the pairs of one tag on one day, from 1."""
    left: Path
    right: Path
    calibration: Path | None
    """None where the folder holds none for that day."""
    taken_at: datetime | None = None
    """By the recording's own clock; None where only the day is known."""

    @property
    def local_time(self) -> datetime:
        """When it was taken; midnight where only the day is known."""
        return (self.taken_at or datetime.combine(self.day, time())).astimezone()

    @property
    def obstacle(self) -> str:
        """Why it cannot be used, whatever its images show; empty where it can."""
        if self.tag_id > HIGHEST_TAG_ID:
            return f"There is no tag {self.tag_id}: they end at {HIGHEST_TAG_ID}."
        if self.calibration:
            return ""
        missing = f"There is no calibration for {self.day}"
        return f"{missing}: put {CALIBRATION_NAMES[0]} into the folder that is imported."


@dataclass(frozen=True, slots=True, order=True)
class FolderProblem:
    """A file or folder that does not fit, with a sentence that says why."""

    path: Path
    text: str
    unpaired: bool = False
    """It is one eye's image without the other's."""


@dataclass(frozen=True, slots=True)
class CaptureFolder:
    """What was found in a folder of captures."""

    captures: tuple[CaptureFile, ...]
    """Sorted by day, tag and view."""
    problems: tuple[FolderProblem, ...]
    checksums: Checksums = NO_CHECKSUMS
    """What lists beside the files say of them."""


Found = Iterator[CaptureFile | FolderProblem]


def read_capture_folder(folder: Path) -> CaptureFolder:
    """All captures in a folder; odd files are listed, not refused."""
    if not folder.is_dir():
        raise BadInput(f"There is no folder {folder}.", "Give the folder that holds the captures.")
    try:
        checksums = read_checksums(folder)
        found = [*_read_days(folder), *_read_recordings(folder), *_read_strays(folder)]
        found += [
            FolderProblem(path, f"{path.name} is not here, and {name} lists it.")
            for path, name in checksums.missing()
        ]
    except OSError as error:
        raise BadInput(f"{folder} cannot be read: {error.strerror}.") from error
    captures = sorted(item for item in found if isinstance(item, CaptureFile))
    problems = sorted(item for item in found if isinstance(item, FolderProblem))
    if not captures:
        raise BadInput(
            f"{folder} holds no captures.",
            "They are expected as <YYYY-MM-DD>/<tag>_<n>_left.png and _right.png.",
        )
    return CaptureFolder(tuple(captures), tuple(problems), checksums)


def visible(folder: Path) -> list[Path]:
    """A folder's members by name, without hidden ones."""
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))


def is_image(path: Path) -> bool:
    """By its name."""
    return path.suffix.lower() in IMAGE_SUFFIXES and path.is_file()


def _read_days(folder: Path) -> Found:
    for path in visible(folder):
        if path.is_dir() and DAY_FOLDER.fullmatch(path.name):
            try:
                day = date.fromisoformat(path.name)
            except ValueError:
                yield FolderProblem(path, f"{path.name} is no day of the calendar.")
                continue
            yield from _read_day(path, day, _plain_calibration(path, folder))


def _plain_calibration(*folders: Path) -> Path | None:
    candidates = (folder / name for folder in folders for name in CALIBRATION_NAMES)
    return next((path for path in candidates if path.is_file()), None)


def _read_day(folder: Path, day: date, calibration: Path | None) -> Found:
    eyes: dict[tuple[int, int], dict[str, Path]] = {}
    for path in visible(folder):
        match = VIEW_FILE.fullmatch(path.stem)
        if match is None or not is_image(path):
            if path.name not in CALIBRATION_NAMES and not is_list(path):
                yield FolderProblem(path, f"{path.name} is no <tag>_<n>_left or _right image.")
            continue
        known = eyes.setdefault((int(match[1]), int(match[2])), {})
        if (eye := match[3].lower()) in known:
            yield FolderProblem(path, f"{path.name} and {known[eye].name} are the same view.")
            continue
        known[eye] = path
    for (tag_id, view), sides in eyes.items():
        if len(sides) == 2:
            yield CaptureFile(day, tag_id, view, sides["left"], sides["right"], calibration)
        else:
            yield from (lonely(path) for path in sides.values())


def lonely(path: Path) -> FolderProblem:
    """The problem of an image whose other eye is missing."""
    return FolderProblem(path, f"{path.name} has no partner from the other eye.", unpaired=True)


def _read_recordings(folder: Path) -> Found:
    """Recordings in the order of their times, so that views count upwards."""
    views: Counter[tuple[date, int]] = Counter()
    calibrations = _dated_calibrations(folder)
    recordings = []
    for path in visible(folder):
        match = RECORDING_FOLDER.fullmatch(path.name)
        if match is None or not path.is_dir():
            continue
        try:
            started = datetime.strptime(match[2], "%Y-%m-%d-%H-%M-%S")
        except ValueError:
            yield FolderProblem(path, f"{path.name} does not name a time.")
            continue
        recordings.append((started, int(match[1]), path))
    for started, tag_id, path in sorted(recordings):
        day = recording_day(started)
        calibration = calibrations.get(day) or _plain_calibration(folder)
        for item in _read_recording(path, day, tag_id, calibration):
            if isinstance(item, CaptureFile):
                views[day, tag_id] += 1
                item = replace(item, view=views[day, tag_id], taken_at=started)
            yield item


def recording_day(started: datetime) -> date:
    """The day that a recording counts for."""
    return (started - timedelta(hours=DAY_STARTS_AT_HOUR)).date()


def _dated_calibrations(folder: Path) -> dict[date, Path]:
    """Calibrations by day; those in the folder itself come before camera_info's."""
    found: dict[date, Path] = {}
    for place in (folder / CALIBRATION_FOLDER, folder):
        for path in sorted(place.glob("*.y*ml")):
            if DATED_CALIBRATION.fullmatch(path.stem):
                try:
                    day = datetime.strptime(path.stem, "%Y_%m_%d").date()
                except ValueError:
                    continue
                found[day] = path
    return found


def _read_recording(folder: Path, day: date, tag_id: int, calibration: Path | None) -> Found:
    colour = folder / "COLOR"
    images = [path for path in visible(colour) if is_image(path)] if colour.is_dir() else []
    if not images:
        yield FolderProblem(folder, f"{folder.name} holds no images in COLOR.")
    for path in images:
        if "LEFT" in path.name:
            right = path.with_name(path.name.replace("LEFT", "RIGHT"))
            if right in images:
                yield CaptureFile(day, tag_id, 0, path, right, calibration)
            else:
                yield lonely(path)
        elif "RIGHT" not in path.name:
            yield FolderProblem(path, f"{path.name} is neither a LEFT nor a RIGHT image.")
        elif path.with_name(path.name.replace("RIGHT", "LEFT")) not in images:
            yield lonely(path)


def _read_strays(folder: Path) -> Found:
    """What belongs to neither layout."""
    for path in visible(folder):
        if path.is_dir():
            known = (
                DAY_FOLDER.fullmatch(path.name)
                or RECORDING_FOLDER.fullmatch(path.name)
                or path.name == CALIBRATION_FOLDER
            )
            if not known:
                yield FolderProblem(path, f"{path.name} is neither a day nor a recording.")
        elif not (
            path.name in CALIBRATION_NAMES
            or DATED_CALIBRATION.fullmatch(path.stem)
            or is_list(path)
        ):
            yield FolderProblem(path, f"{path.name} belongs to no capture.")
