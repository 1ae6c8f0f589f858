"""A camera's clock against the host's monotonic one: offset and drift from latched samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcam.camera.usb3vision.bootstrap import ClockSample

STEADY_DRIFT = 1e-4
"""Crystals stay within 100 parts in a million of each other."""


@dataclass(frozen=True, slots=True)
class DeviceClock:
    """A straight line from device time to host time."""

    device_ns: int
    host_ns: int
    """The host's time at `device_ns`."""
    drift: float
    """Host seconds to a device second, less one."""

    def to_host_ns(self, device_ns: int) -> int:
        elapsed_ns = device_ns - self.device_ns
        return self.host_ns + elapsed_ns + round(elapsed_ns * self.drift)


def fit_clock(samples: Sequence[ClockSample]) -> DeviceClock:
    """The line through at least one sample, each weighted by how sure it is.

    Samples too close in time to tell more about the drift than is known of any crystal
    give the offset only.
    """
    weight = np.array([1.0 / (sample.uncertainty_ns + 1_000) ** 2 for sample in samples])
    weight /= weight.sum()
    # Against the first sample, since nanoseconds of years do not fit into a float.
    first = samples[0]
    device = np.array([float(sample.device_ns - first.device_ns) for sample in samples])
    host = np.array([float(sample.host_ns - first.host_ns) for sample in samples])
    center, offset = float(weight @ device), float(weight @ (host - device))
    drift = 0.0
    spread = device - center
    uncertainty_ns = max(sample.uncertainty_ns for sample in samples) + 1_000
    if np.ptp(device) * STEADY_DRIFT > 2 * uncertainty_ns:
        slope = float(weight @ (spread * (host - device - offset)) / (weight @ spread**2))
        drift = min(max(slope, -2 * STEADY_DRIFT), 2 * STEADY_DRIFT)
    place_ns = round(center)
    return DeviceClock(first.device_ns + place_ns, first.host_ns + place_ns + round(offset), drift)
