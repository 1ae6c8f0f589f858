"""The files of one recorded pair, checked before any of them is kept."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from fieldcam.calibration.reading.readers import load_camera
from fieldcam.errors import BadInput, PairMismatch
from fieldcam.exchange.capture_folder import CaptureFile
from fieldcam.exchange.image_files import ImageFile, check_same_size, read_image_file
from fieldcam.foreign.bounds import CALIBRATION
from fieldcam.foreign.files import read_foreign
from fieldcam.images.pixels import check_size
from fieldcam.values import PixelFormat


@dataclass(frozen=True, slots=True, eq=False)
class PairFiles:
    """Both images and their calibration, byte for byte."""

    left: ImageFile
    right: ImageFile
    calibration: bytes

    def contents(self, file: CaptureFile) -> Iterator[tuple[Path, bytes]]:
        """What was read from each of the capture's files."""
        yield file.left, self.left.content
        yield file.right, self.right.content
        if file.calibration is not None:
            yield file.calibration, self.calibration

    @property
    def pixel_format(self) -> PixelFormat:
        """A PGM that was exported is grey; nothing in it says which colour filter it had."""
        return PixelFormat.MONO8 if self.left.suffix == ".pgm" else PixelFormat.RGB8


def read_pair_files(file: CaptureFile) -> PairFiles:
    """Raises BadInput where the pair could not be sized."""
    if file.calibration is None or file.obstacle:
        raise BadInput(file.obstacle)
    left, right = read_image_file(file.left), read_image_file(file.right)
    check_same_size(left, right)
    if (left.suffix == ".pgm") != (right.suffix == ".pgm"):
        raise PairMismatch(f"Only one of {left.name} and {right.name} is in colour.")
    return PairFiles(left, right, _checked_calibration(file.calibration, left.size_px))


@lru_cache(maxsize=4)
def _checked_calibration(path: Path, size_px: tuple[int, int]) -> bytes:
    """Its content, if it describes a camera that gives images of this size."""
    found = load_camera(path, size_px)
    check_size(size_px, found.size_px)
    return read_foreign(path, CALIBRATION)
