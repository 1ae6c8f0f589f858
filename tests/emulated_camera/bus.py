"""The bus: which devices are plugged in where, and the lock under which they act."""

from __future__ import annotations

import errno
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition

from .clocks import Clock, MachineClock
from .descriptors import Speed
from .faults import Fault
from .pipes import Taken
from .usb_device import UsbFunction

FIRST_ADDRESS, HIGHEST_ADDRESS = 2, 127
"""The root hub has the one before."""


@dataclass(frozen=True, slots=True, eq=False)
class Plugged:
    """A device on the bus, from plugging to unplugging."""

    function: UsbFunction
    speed: Speed
    port: int
    address: int
    permitted: bool
    """Whether this user may open it."""

    @property
    def bus_number(self) -> int:
        """The two speeds of a port are two buses, as of a real controller."""
        return 2 if self.speed is Speed.SUPER else 1


Listener = Callable[[Plugged, bool], None]
"""Called after a device came (True) or went (False)."""


class UsbBus:
    """A host controller with free ports; any thread may use it."""

    def __init__(self, clock: Clock | None = None) -> None:
        self.clock = clock or MachineClock()
        self.changed = Condition()
        """Its lock guards everything on the bus; notified when something happens to it."""
        self._plugged: list[Plugged] = []
        self._last_address = FIRST_ADDRESS - 1
        self._listeners: list[Listener] = []
        self._appointments: list[tuple[int, Callable[[], None]]] = []

    @property
    def plugged(self) -> tuple[Plugged, ...]:
        with self.changed:
            return tuple(self._plugged)

    def tell(self, listener: Listener) -> None:
        """Call this, under the lock, whenever a device comes or goes."""
        self._listeners.append(listener)

    def plug(
        self, function: UsbFunction, speed: Speed = Speed.SUPER, permitted: bool = True
    ) -> Plugged:
        """Plug a device in; it gets a new address each time."""
        with self.changed:
            taken = {plugged.port for plugged in self._plugged}
            port = next(n for n in range(1, 16) if n not in taken)
            plugged = Plugged(function, speed, port, self._free_address(), permitted)
            function.powered(speed, self.clock.now_ns())
            self._plugged.append(plugged)
            self._announce(plugged, True)
            return plugged

    def unplug(self, function: UsbFunction) -> None:
        """Pull the plug; does nothing where it is not plugged in."""
        with self.changed:
            for plugged in [p for p in self._plugged if p.function is function]:
                self._plugged.remove(plugged)
                self._announce(plugged, False)

    def is_plugged(self, plugged: Plugged) -> bool:
        with self.changed:
            return plugged in self._plugged

    def at(self, when_ns: int, act: Callable[[], None]) -> None:
        """Do something at this time, or at the first chance afterwards."""
        with self.changed:
            self._appointments.append((when_ns, act))

    def send(self, plugged: Plugged, endpoint: int, data: bytes) -> int:
        """A bulk OUT transfer; gives an errno, 0 where it went well."""
        with self.changed:
            now_ns = self.poll()
            if not self.is_plugged(plugged):
                return errno.ENODEV
            if plugged.function.faults.strikes(Fault.NO_MEMORY):
                return errno.ENOMEM
            plugged.function.received(endpoint, data, now_ns)
            self.changed.notify_all()
            return 0

    def take(self, plugged: Plugged, endpoint: int, length: int) -> Taken | None:
        """The answer to a bulk IN request; None where it has to wait."""
        with self.changed:
            now_ns = self.poll()
            pipe = plugged.function.pipes.get(endpoint)
            if pipe is None or not self.is_plugged(plugged):
                return Taken(memoryview(b""), errno.ENODEV)
            taken = pipe.take(length, now_ns)
            if taken and taken.error == errno.ENODEV:
                self.unplug(plugged.function)
            return taken

    def poll(self) -> int:
        """Let everything happen that is due, and give the time."""
        with self.changed:
            now_ns = self.clock.now_ns()
            due = [one for one in self._appointments if one[0] <= now_ns]
            for one in due:
                self._appointments.remove(one)
                one[1]()
            for plugged in tuple(self._plugged):
                plugged.function.poll(now_ns)
            return now_ns

    def _free_address(self) -> int:
        """The one after the last, as the kernel does; it has seven bits and begins anew."""
        taken = {plugged.address for plugged in self._plugged}
        behind = (
            *range(self._last_address + 1, HIGHEST_ADDRESS + 1),
            *range(FIRST_ADDRESS, HIGHEST_ADDRESS + 1),
        )
        self._last_address = next(n for n in behind if n not in taken)
        return self._last_address

    def _announce(self, plugged: Plugged, came: bool) -> None:
        for listener in self._listeners:
            listener(plugged, came)
        self.changed.notify_all()
