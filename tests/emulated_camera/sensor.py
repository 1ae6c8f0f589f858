"""How one camera turns what its eyes see into images."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from .bootstrap import FileKind
from .pictures import AMBIENT, NOMINAL_US, Darkroom, Development, Image
from .settings import Settings
from .shutter import Exposure


class Eyes(Enum):
    """Which pictures a camera sends as blocks."""

    LEFT = "left"
    RIGHT = "right"
    BESIDE = "side by side"
    """Both in one block, the left one in the left half."""
    ALTERNATING = "alternating"
    """Two blocks after each other with equal timestamps: the left, then the right one."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """What differs between cameras."""

    eyes: Eyes = Eyes.LEFT
    width_px: int = 1440
    """Of one eye."""
    height_px: int = 1080
    drift_ppm: float = 0.0
    file_kind: FileKind = FileKind.ZIPPED
    bytes_per_s: float | None = None
    """Of the link; None as fast as its speed allows."""
    ack_ms: float = 0.0
    """How long each ack takes."""
    blocks_kept: int = 32
    """So many blocks wait for a slow host; later ones are lost, and their ids with them."""

    @property
    def size_px(self) -> tuple[int, int]:
        return self.width_px * (2 if self.eyes is Eyes.BESIDE else 1), self.height_px


class Imager:
    """Applies the camera's settings to pictures."""

    def __init__(self, sensor: Sensor, settings: Settings) -> None:
        self._sensor = sensor
        self._settings = settings
        self._darkroom = Darkroom()

    def images(self, left: Image, right: Image, exposure: Exposure, lit_us: float) -> list[Image]:
        """What goes out as blocks, one after the other."""
        wanted = {
            Eyes.LEFT: [left],
            Eyes.RIGHT: [right],
            Eyes.BESIDE: [left, right],
            Eyes.ALTERNATING: [left, right],
        }[self._sensor.eyes]
        development = self._development(exposure, lit_us)
        found = [self._darkroom.develop(picture, development) for picture in wanted]
        if self._sensor.eyes is Eyes.BESIDE:
            found = [np.hstack(found)]
        return [self._cropped(image) for image in found]

    def region(self) -> tuple[int, int, int, int]:
        """x, y, width and height of what is read out, as far as it lies on the sensor."""
        x, y, width, height = (
            self._settings.integer(name) for name in ("OffsetX", "OffsetY", "Width", "Height")
        )
        widest, highest = self._sensor.size_px
        return min(x, widest - width), min(y, highest - height), width, height

    def _development(self, exposure: Exposure, lit_us: float) -> Development:
        gain = 10 ** (self._settings.real("Gain") / 20)
        light_us = lit_us + AMBIENT * exposure.length_us
        return Development(
            gain * light_us / NOMINAL_US,
            self._settings.real("BlackLevel"),
            self._settings.real("BalanceRatio", 0),
            self._settings.real("BalanceRatio", 1),
        )

    def _cropped(self, image: Image) -> Image:
        x, y, width, height = self.region()
        return np.ascontiguousarray(image[y : y + height, x : x + width])
