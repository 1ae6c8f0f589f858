"""The texts in a tarball of ROS's camera_calibration, among the pictures that it keeps there."""

from __future__ import annotations

import tarfile
import zlib
from pathlib import Path, PurePosixPath

from fieldcam.errors import CalibrationInvalid
from fieldcam.foreign.bounds import CALIBRATION, TARBALL
from fieldcam.foreign.child import read_in_child

STEMS = ("intrinsics", "extrinsics", "left", "right", "ost", "camchain")
"""The first ones that make a camera count."""
SUFFIXES = (".yml", ".yaml", ".txt")


def tarball_texts(path: Path) -> dict[str, bytes]:
    """What is called like a calibration in it, by stem in their order; raises CalibrationInvalid.

    In a process of its own, since a small archive may unpack to any size.
    """
    found = read_in_child(unpacked_texts, path, TARBALL)
    return {stem: found[stem] for stem in STEMS if stem in found}


def unpacked_texts(path: Path) -> dict[str, bytes]:
    found: dict[str, bytes] = {}
    try:
        with tarfile.open(path) as archive:
            for member in archive:
                name = PurePosixPath(member.name)
                if not (member.isreg() and name.stem in STEMS and name.suffix in SUFFIXES):
                    continue
                file = archive.extractfile(member)
                assert file is not None  # of a regular member
                found.setdefault(name.stem, file.read(CALIBRATION.most_bytes + 1))
    except (tarfile.TarError, zlib.error, EOFError, OSError, ValueError) as error:
        raise CalibrationInvalid(f"{path} is a damaged archive.", "Copy it again.") from error
    return found
