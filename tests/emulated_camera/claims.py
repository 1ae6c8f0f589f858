"""Which opened file holds which interface of a device, by the kernel's rules."""

from __future__ import annotations

import threading

from .bus import Plugged
from .descriptors import (
    CONTROL_IN,
    CONTROL_INTERFACE,
    CONTROL_OUT,
    EVENT_IN,
    EVENT_INTERFACE,
    STREAM_IN,
    STREAM_INTERFACE,
)

INTERFACES = {
    CONTROL_OUT: CONTROL_INTERFACE,
    CONTROL_IN: CONTROL_INTERFACE,
    EVENT_IN: EVENT_INTERFACE,
    STREAM_IN: STREAM_INTERFACE,
}
"""By endpoint."""


class Claims:
    """Those of all files on a bus; any thread may ask."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._holders: dict[tuple[Plugged, int], object] = {}

    def take(self, plugged: Plugged, interface: int, file: object) -> bool:
        """Whether this file holds the interface now; it may have held it before."""
        with self._lock:
            return self._holders.setdefault((plugged, interface), file) is file

    def give_back(self, plugged: Plugged, interface: int, file: object) -> bool:
        """Whether it was this file's."""
        with self._lock:
            if self._holders.get((plugged, interface)) is not file:
                return False
            del self._holders[plugged, interface]
            return True

    def is_held(self, plugged: Plugged, interface: int) -> bool:
        with self._lock:
            return (plugged, interface) in self._holders

    def others_hold(self, plugged: Plugged, file: object) -> bool:
        """Any interface of the device."""
        with self._lock:
            return any(
                each is plugged and holder is not file
                for (each, _), holder in self._holders.items()
            )

    def drop(self, file: object) -> None:
        """The file was closed, by its owner or by the kernel after it."""
        with self._lock:
            self._holders = {key: one for key, one in self._holders.items() if one is not file}
