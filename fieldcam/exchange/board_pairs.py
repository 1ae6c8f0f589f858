"""Reads a folder of pairs without tags: pictures of a calibration board.

`DIR/<name>_left.png` with `<name>_right.png`; or the authors' names, `*LEFT*.png` with
the same in RIGHT; or the same names in two folders, `DIR/left` and `DIR/right`.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.capture_folder import FolderProblem, is_image, lonely, visible
from fieldcam.words import number_of

OWN_NAME = re.compile(r"(.*[^_])_(left|right)", re.ASCII)
EYES = ("left", "right")
EXPECTED = "Pairs are expected as <n>_left.png and <n>_right.png."


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
        images = list(_named(folder))
    except OSError as error:
        raise BadInput(f"{folder} cannot be read: {error.strerror}.") from error
    found = list(_paired(images))
    pairs = sorted((each for each in found if isinstance(each, PairPaths)), key=_order)
    problems = sorted(each for each in found if isinstance(each, FolderProblem))
    if not pairs:
        why = _why_no_pairs(Counter(eye for _, eye, _ in images))
        raise BadInput(f"{folder} holds {why}.", EXPECTED)
    return PairFolder(tuple(pairs), tuple(problems))


Image = tuple[str, str, Path]
"""Its name that both eyes share, its eye, and where it lies."""


def _why_no_pairs(images: Counter[str]) -> str:
    """By the images of each eye."""
    if not images:
        return "no pairs"
    if len(images) == len(EYES):
        return "images of both eyes, but no two of the same name"
    (eye,) = images
    other = next(each for each in EYES if each != eye)
    return f"{number_of(images[eye], 'image')} of the {eye} eye and none of the {other} one"


def _named(folder: Path) -> Iterator[Image]:
    members = {path.name.lower(): path for path in visible(folder) if path.is_dir()}
    folders = {eye: members[eye] for eye in EYES if eye in members}
    if len(folders) < len(EYES):
        yield from _named_by_eye(folder)
    yield from _named_alike(folders)


def _named_alike(folders: Mapping[str, Path]) -> Iterator[Image]:
    for eye, folder in folders.items():
        yield from ((path.stem, eye, path) for path in visible(folder) if is_image(path))


def _named_by_eye(folder: Path) -> Iterator[Image]:
    for path in visible(folder):
        if not is_image(path):
            continue
        if match := OWN_NAME.fullmatch(path.stem):
            yield match[1], match[2], path
        elif "LEFT" in path.stem:
            yield path.stem.replace("LEFT", "*"), "left", path
        elif "RIGHT" in path.stem:
            yield path.stem.replace("RIGHT", "*"), "right", path


def _paired(images: Iterable[Image]) -> Iterator[PairPaths | FolderProblem]:
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
