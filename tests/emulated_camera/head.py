"""A stereo head: what its cameras share, namely the flash, a wire, and what they look at."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from .bus import UsbBus
from .pictures import Image, PictureSource
from .shutter import Exposure

_SAME_EXPOSURE_NS = 1_000_000
"""Exposures that begin this close to each other see the same picture."""


class Wired(Protocol):
    """A camera, as the others on the wire know it."""

    def edge(self, line: str, rising: bool, now_ns: int) -> None: ...


class Head:
    """All calls are made under the bus's lock."""

    def __init__(self, bus: UsbBus, source: PictureSource) -> None:
        self.bus = bus
        self.flashes = 0
        """How often the flash has fired."""
        self._source = source
        self._wired: list[Wired] = []
        self._ordinal = -1
        self._begun_ns: int | None = None
        self._pulse_ns = (0, 0)

    def wire(self, camera: Wired) -> None:
        self._wired.append(camera)

    def now_ns(self) -> int:
        return self.bus.clock.now_ns()

    def edge(self, sender: Wired, line: str, rising: bool, now_ns: int) -> None:
        """Carry a change of the wire's level to all other cameras."""
        for camera in self._wired:
            if camera is not sender:
                camera.edge(line, rising, now_ns)

    def flash(self, start_ns: int, end_ns: int) -> None:
        """Light everything for this time."""
        self.flashes += 1
        self._pulse_ns = (start_ns, end_ns)

    def lit_us(self, exposure: Exposure) -> float:
        """For how much of an exposure the flash shines."""
        start_ns = max(exposure.start_ns, self._pulse_ns[0])
        end_ns = min(exposure.end_ns, self._pulse_ns[1])
        return max(0, end_ns - start_ns) / 1000

    def look(self, exposure: Exposure) -> tuple[Image, Image]:
        """What both eyes see; the same for exposures that belong together."""
        begun_ns = self._begun_ns
        if begun_ns is None or abs(exposure.start_ns - begun_ns) > _SAME_EXPOSURE_NS:
            self._ordinal += 1
            self._begun_ns = exposure.start_ns
        return self._source(self._ordinal)

    def later(self, after_ns: int, act: Callable[[], None]) -> None:
        """Do something after this time."""
        self.bus.at(self.now_ns() + after_ns, act)
