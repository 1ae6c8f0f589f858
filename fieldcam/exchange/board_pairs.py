"""Reads a folder of pairs without tags: pictures of a calibration board.

The names of two images of one exposure differ in what names the eye (`eye_names`), or
are the same in two folders that name it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.capture_folder import FolderProblem, is_image, lonely, visible
from fieldcam.exchange.eye_names import EYES, NAMINGS, Naming
from fieldcam.words import number_of

EXPECTED = (
    "Pairs are expected as <n>_left.png and <n>_right.png, or of the same names in the folders"
    " left and right."
)
INNER = "data"
"""Below each camera's folder, in recordings of robots."""


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
        named = [list(_named(folder, naming)) for naming in NAMINGS]
    except OSError as error:
        raise BadInput(f"{folder} cannot be read: {error.strerror}.") from error
    images = max(named, key=_pairs_of)
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


def _pairs_of(images: list[Image]) -> tuple[int, int]:
    """How many names both eyes share; where none is shared, how many are of an eye at all."""
    eyes = [{name for name, each, _ in images if each == eye} for eye in EYES]
    return len(eyes[0] & eyes[1]), len(images)


def _named(folder: Path, naming: Naming) -> Iterator[Image]:
    members = visible(folder)
    folders = {
        told[1]: path for path in members if path.is_dir() if (told := naming.told(path.name))
    }
    if len(folders) < len(EYES):
        for path in members:
            if is_image(path) and (told := naming.told(path.stem)):
                yield *told, path
    for eye, path in folders.items():
        yield from ((_inside(naming, each, eye), eye, each) for each in _images(path))


def _inside(naming: Naming, path: Path, eye: str) -> str:
    """The eye may be named once more within its folder: left/left01.jpg."""
    told = naming.told(path.stem)
    return told[0] if told is not None and told[1] == eye else path.stem


def _images(folder: Path) -> list[Path]:
    inner = folder / INNER
    found = [path for path in visible(folder) if is_image(path)]
    return found or ([path for path in visible(inner) if is_image(path)] if inner.is_dir() else [])


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
