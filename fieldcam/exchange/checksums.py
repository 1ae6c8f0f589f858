"""Lists of checksums that lie beside recorded files, such as `SHA256SUMS`.

As `sha256sum` and its like write them, one file a line, in the form of GNU
(`<sum>  <name>`) or of BSD (`SHA256 (<name>) = <sum>`), and the manifests of BagIt bags.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import new
from pathlib import Path

from fieldcam.errors import ImageUnreadable

LIST_NAME = re.compile(
    r"(.*[._-])?(md5|sha-?(1|224|256|384|512))(sums?)?(\.txt)?|(.*[._-])?checksums?(\.txt)?", re.I
)
GNU_LINE = re.compile(r"\\?([0-9a-fA-F]{32,128}) [ *]?(.+)")
BSD_LINE = re.compile(r"[A-Za-z0-9-]+ \((.+)\) = ([0-9a-fA-F]{32,128})")
ALGORITHMS = {32: "md5", 40: "sha1", 56: "sha224", 64: "sha256", 96: "sha384", 128: "sha512"}
"""By the length of a sum."""
LARGEST_BYTES = 1 << 24
"""A longer file is no list of a season's pictures."""


@dataclass(frozen=True, slots=True)
class Listed:
    """What a list says about one file."""

    sum: str
    """Lower-case hexadecimal."""
    list_name: str


@dataclass(frozen=True, slots=True)
class Checksums:
    """What all lists of a folder say, by absolute path."""

    files: Mapping[Path, Listed] = field(default_factory=dict)

    def check(self, path: Path, content: bytes) -> None:
        """Raises ImageUnreadable where a list names the file and its content is another one."""
        listed = self.files.get(path.absolute())
        if listed is None:
            return
        digest = new(ALGORITHMS[len(listed.sum)], content, usedforsecurity=False).hexdigest()
        if digest != listed.sum:
            raise ImageUnreadable(
                f"{path.name} is not the file that {listed.list_name} lists: it is damaged.",
                "Copy it again.",
            )

    def missing(self) -> Iterator[tuple[Path, str]]:
        """Files that are listed and not there, each with the name of its list."""
        for path, listed in self.files.items():
            if not path.exists():
                yield path, listed.list_name


def is_list(path: Path) -> bool:
    """By its name."""
    return LIST_NAME.fullmatch(path.name) is not None


def read_checksums(folder: Path) -> Checksums:
    """What all lists in a folder, below it and beside it say of its files.

    What a list names is meant from where it lies.
    """
    inside = folder.absolute()
    lists = (p for p in sorted([*inside.parent.iterdir(), *inside.rglob("*")]) if is_list(p))
    named = (entry for path in lists if path.is_file() for entry in _read(path))
    return Checksums({file: said for file, said in named if file.is_relative_to(inside)})


def _read(path: Path) -> Iterator[tuple[Path, Listed]]:
    with path.open("rb") as stream:
        text = stream.read(LARGEST_BYTES).decode("utf-8-sig", errors="surrogateescape")
    for line in text.splitlines():
        name, digest = _parsed(line.strip())
        if len(digest) in ALGORITHMS:
            yield (path.parent / name).absolute(), Listed(digest.lower(), path.name)


def _parsed(line: str) -> tuple[str, str]:
    """The file and its sum; both empty where the line says neither."""
    if bsd := BSD_LINE.fullmatch(line):
        return bsd[1], bsd[2]
    if gnu := GNU_LINE.fullmatch(line):
        return gnu[2].removeprefix("./"), gnu[1]
    return "", ""
