"""What makes a developed pair a rectified one, by what describes its camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from fieldcam.calibration.reading.readers import load_camera
from fieldcam.calibration.rectification import Rectifier
from fieldcam.values import Calibration, StereoPair


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """Gives pairs that `calibration` describes."""

    calibration: Calibration
    rectifier: Rectifier | None = None
    """None where the pairs are rectified already."""

    def rectify(self, pair: StereoPair) -> StereoPair:
        return pair if self.rectifier is None else self.rectifier.rectify(pair)


def open_camera(source: Calibration | Path, size_px: tuple[int, int] | None = None) -> Camera:
    """`size_px` stands in where a file does not give the image size."""
    found = load_camera(source, size_px) if isinstance(source, Path) else source
    if isinstance(found, Calibration):
        return Camera(found)
    return Camera(found.rectified, Rectifier(found))


@lru_cache(maxsize=4)
def own_camera(calibration: Path, size_px: tuple[int, int]) -> Camera:
    """As `open_camera`, for files that never change."""
    return open_camera(calibration, size_px)
