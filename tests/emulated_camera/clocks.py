"""The time by which cameras act: the machine's, or one that a test moves on."""

from __future__ import annotations

from threading import Condition
from time import monotonic_ns
from typing import Protocol


class Clock(Protocol):
    """Nanoseconds since some moment."""

    def now_ns(self) -> int: ...

    def wait(self, changed: Condition, longest_ns: int) -> None:
        """Let up to this time pass, less when `changed`, which the caller holds, is notified."""
        ...


class MachineClock:
    """Real time."""

    def now_ns(self) -> int:
        return monotonic_ns()

    def wait(self, changed: Condition, longest_ns: int) -> None:
        changed.wait(longest_ns / 1e9)


class SteppedClock:
    """Moves on only when somebody waits, and then at once: timeouts take no time.

    For one thread.
    """

    def __init__(self) -> None:
        self._now_ns = 1_000_000_000

    def now_ns(self) -> int:
        return self._now_ns

    def wait(self, changed: Condition, longest_ns: int) -> None:
        self._now_ns += longest_ns


class DeviceClock:
    """The counter in a camera: starts at 0 when it is plugged in, and runs a little wrong."""

    def __init__(self, started_ns: int, drift_ppm: float = 0.0) -> None:
        self._started_ns = started_ns
        self._rate = 1.0 + drift_ppm * 1e-6

    def at(self, now_ns: int) -> int:
        """What it shows at this moment of the machine's."""
        return round((now_ns - self._started_ns) * self._rate)
