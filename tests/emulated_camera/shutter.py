"""When a camera exposes: by itself at its frame rate, or when it is triggered."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from .features import LINES
from .settings import Settings

READOUT_NS = 6_000_000
"""From the end of the exposure until the sensor can start the next without overlap."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """One opening of the shutter, in the machine's time."""

    start_ns: int
    end_ns: int

    @property
    def length_us(self) -> float:
        return (self.end_ns - self.start_ns) / 1000


class Shutter:
    """Says when exposures begin; what becomes of them is the camera's."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.running = False
        self.missed = 0
        """Triggers that came while the camera could not take them."""
        self._free_ns = 0
        self._next_ns = 0
        self._left = 0.0
        self._count = 0

    def start(self, now_ns: int) -> None:
        self.running = True
        self._free_ns = self._next_ns = now_ns
        single = self._settings.chosen("AcquisitionMode") == "SingleFrame"
        self._left = 1 if single else float("inf")

    def stop(self) -> None:
        self.running = False

    @property
    def triggered(self) -> bool:
        return self._settings.chosen("TriggerMode") == "On"

    def triggers(self, source: str, rising: bool = True) -> bool:
        """Whether this edge or command is what the camera waits for."""
        edge = "RisingEdge" if rising else "FallingEdge"
        wanted = source not in LINES or self._settings.chosen("TriggerActivation") == edge
        return self.triggered and wanted and self._settings.chosen("TriggerSource") == source

    def fire(self, now_ns: int) -> Exposure | None:
        """Begin an exposure after the trigger's delay; None while the sensor is busy."""
        start_ns = now_ns + round(self._settings.real("TriggerDelay") * 1000)
        if not self.running:
            return None
        if start_ns < self._free_ns:
            self.missed += 1
            return None
        return self._exposure(start_ns)

    def free_running(self, now_ns: int) -> Iterator[Exposure]:
        """Those exposures that have begun since the last time, unless triggers are waited for."""
        while self.running and not self.triggered and self._next_ns <= now_ns:
            start_ns = max(self._next_ns, self._free_ns)
            if start_ns > now_ns:
                return
            yield self._exposure(start_ns)
            self._next_ns = start_ns + self._period_ns()

    def _exposure(self, start_ns: int) -> Exposure:
        end_ns = start_ns + round(self._exposure_us() * 1000)
        overlaps = self._settings.chosen("TriggerOverlap") == "ReadOut" or not self.triggered
        self._free_ns = end_ns + (0 if overlaps else READOUT_NS)
        self._count += 1
        self._left -= 1
        if self._left <= 0:
            self.running = False
        return Exposure(start_ns, end_ns)

    def _exposure_us(self) -> float:
        """What was set; with the automatic on it wanders, as in a changing light."""
        wander = (1.0, 1.4, 0.7)[self._count % 3]
        automatic = self._settings.chosen("ExposureAuto") != "Off"
        return self._settings.real("ExposureTime") * (wander if automatic else 1.0)

    def _period_ns(self) -> int:
        limited = self._settings.integer("AcquisitionFrameRateEnable")
        rate_hz = self._settings.real("AcquisitionFrameRate") if limited else 120.0
        return round(1e9 / rate_hz)
