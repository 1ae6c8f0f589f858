"""Reads a folder of pairs without tags: pictures of a calibration board.

`DIR/<name>_left.png` with `<name>_right.png`; or the authors' names, `*LEFT*.png` with
the same in RIGHT; or the same names in two folders, `DIR/left` and `DIR/right`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.capture_folder import FolderProblem, is_image, lonely, visible

OWN_NAME = re.compile(r"(.*[^_])_(left|right)", re.ASCII)
EYES = ("left", "right")


@dataclass(frozen=True, slots=True)
class PairPaths:
    """The two images of one exposure."""

    name: str
    left: Path
    right: Path


@dataclass(frozen=True, slots=True)
class PairFolder:
    """What was found in a folder."""

    pairs: tuple[PairPaths, ...]
    """Sorted by name, numbers by their value."""
    problems: tuple[FolderProblem, ...]


def read_pair_folder(folder: Path) -> PairFolder:
    """All pairs in a folder; odd files are listed, not refused."""
    if not folder.is_dir():
        raise BadInput(f"There is no folder {folder}.", "Give the folder that holds the pairs.")
    try:
        eyes = _folders_of_eyes(folder)
        found = list(_paired(_named_alike(*eyes) if eyes else _named_by_eye(folder)))
    except OSError as error:
        raise BadInput(f"{folder} cannot be read: {error.strerror}.") from error
    pairs = sorted((each for each in found if isinstance(each, PairPaths)), key=_order)
    problems = sorted(each for each in found if isinstance(each, FolderProblem))
    if not pairs:
        raise BadInput(
            f"{folder} holds no pairs.", "They are expected as <n>_left.png and <n>_right.png."
        )
    return PairFolder(tuple(pairs), tuple(problems))


Named = Iterator[tuple[str, str, Path]]
"""Each image's name that both eyes share, its eye, and where it lies."""


def _folders_of_eyes(folder: Path) -> tuple[Path, Path] | None:
    members = {path.name.lower(): path for path in visible(folder) if path.is_dir()}
    if not all(eye in members for eye in EYES):
        return None
    return members["left"], members["right"]


def _named_alike(left: Path, right: Path) -> Named:
    for eye, folder in zip(EYES, (left, right), strict=True):
        yield from ((path.stem, eye, path) for path in visible(folder) if is_image(path))


def _named_by_eye(folder: Path) -> Named:
    for path in visible(folder):
        if not is_image(path):
            continue
        if match := OWN_NAME.fullmatch(path.stem):
            yield match[1], match[2], path
        elif "LEFT" in path.stem:
            yield path.stem.replace("LEFT", "*"), "left", path
        elif "RIGHT" in path.stem:
            yield path.stem.replace("RIGHT", "*"), "right", path


def _paired(images: Named) -> Iterator[PairPaths | FolderProblem]:
    eyes: dict[str, dict[str, Path]] = {}
    for name, eye, path in images:
        known = eyes.setdefault(name, {})
        if eye in known:
            yield FolderProblem(path, f"{path.name} and {known[eye].name} are the same view.")
        else:
            known[eye] = path
    for name, sides in eyes.items():
        if len(sides) == len(EYES):
            yield PairPaths(name, sides["left"], sides["right"])
        else:
            yield from (lonely(path) for path in sides.values())


def _order(pair: PairPaths) -> tuple[list[tuple[int, str]], str]:
    """10 comes after 9."""
    parts = re.findall(r"\d+|\D+", pair.name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts], pair.name
