"""What one opened device file has asked for: URBs that wait, and URBs that are done."""

from __future__ import annotations

import errno
import struct
from collections import deque
from dataclasses import dataclass

from .bus import Plugged, UsbBus
from .faults import Fault
from .usb_device import Setup, Stalled, control

URB = struct.Struct("<BBxxiIxxxxQii4iQ")
"""`struct usbdevfs_urb` of 64-bit Linux; of it type, endpoint, status, flags, buffer, lengths."""
_CONTROL, _BULK = 2, 3
_SHORT_NOT_OK, _CONTINUES = 0x01, 0x04
_SETUP_BYTES = 8
_NOTHING = memoryview(b"")
_IN = 0x80


@dataclass(slots=True)
class Urb:
    """One request of libusb's; addresses are those of the client's memory."""

    address: int
    raw: bytes
    type: int
    endpoint: int
    flags: int
    buffer: int
    length: int
    data: memoryview = _NOTHING
    """What the client gets."""
    status: int = 0
    actual: int = 0

    @classmethod
    def parse(cls, address: int, raw: bytes) -> Urb:
        kind, endpoint, _, flags, buffer, length, *_ = URB.unpack(raw)
        return cls(address, raw, kind, endpoint, flags, buffer, length)

    @property
    def wants_data(self) -> bool:
        """Whether the client's buffer has to be read before anything is done."""
        return self.type == _CONTROL or not self.endpoint & _IN

    @property
    def data_at(self) -> int:
        """Where in the client's memory the answer goes."""
        return self.buffer + (_SETUP_BYTES if self.type == _CONTROL else 0)

    def finished(self) -> bytes:
        """The structure with its status and length."""
        fields = list(URB.unpack(self.raw))
        fields[2], fields[6] = self.status, self.actual
        return URB.pack(*fields)


class UrbQueue:
    """Carries URBs out in order, by the kernel's rules for transfers cut into several.

    A URB flagged as a continuation belongs to the transfer of the one before. When one
    of a transfer comes back short though it must not, the rest of the transfer is
    cancelled, and submitting more of it is refused until a new one begins.
    """

    def __init__(self, bus: UsbBus, plugged: Plugged, limit_bytes: int) -> None:
        self._bus = bus
        self._plugged = plugged
        self._faults = plugged.function.faults
        self._limit_bytes = limit_bytes
        self._waiting: dict[int, deque[Urb]] = {}
        self._done: deque[Urb] = deque()
        self._cut_short: set[int] = set()

    def submit(self, urb: Urb, data: bytes) -> int:
        """Take a URB, with the client's data where it wants that; gives an errno or 0."""
        with self._bus.changed:
            self._bus.poll()
            if not self._bus.is_plugged(self._plugged):
                return errno.ENODEV
            if urb.type == _CONTROL:
                self._control(urb, data)
                return 0
            if urb.type != _BULK:
                return errno.EINVAL
            if not urb.endpoint & _IN:
                return self._write(urb, data)
            return self._wait(urb)

    def discard(self, address: int) -> int:
        """Cancel a URB that waits; gives an errno or 0."""
        with self._bus.changed:
            for waiting in self._waiting.values():
                for urb in waiting:
                    if urb.address == address:
                        waiting.remove(urb)
                        self._finish(urb, -errno.ENOENT)
                        return 0
            return errno.EINVAL

    def reap(self) -> Urb | None:
        """One that is done, if any."""
        with self._bus.changed:
            if not self._done:
                self._advance()
            return self._done.popleft() if self._done else None

    def _wait(self, urb: Urb) -> int:
        continues = bool(urb.flags & _CONTINUES)
        if not continues:
            self._cut_short.discard(urb.endpoint)
        if urb.endpoint in self._cut_short:
            return errno.EREMOTEIO
        held = sum(one.length for queue in self._waiting.values() for one in queue)
        if held + urb.length > self._limit_bytes or self._faults.strikes(Fault.NO_MEMORY):
            return errno.ENOMEM
        self._waiting.setdefault(urb.endpoint, deque()).append(urb)
        return 0

    def _write(self, urb: Urb, data: bytes) -> int:
        error = self._bus.send(self._plugged, urb.endpoint, data)
        if not error:
            urb.actual = urb.length
            self._finish(urb, 0)
        return error

    def _control(self, urb: Urb, data: bytes) -> None:
        setup = Setup.parse(data)
        try:
            answer = control(self._plugged.function, self._plugged.speed, setup)
        except Stalled:
            self._finish(urb, -errno.EPIPE)
            return
        if setup.request_type & _IN:
            urb.data = memoryview(answer)
            urb.actual = len(answer)
        else:
            urb.actual = setup.length
        self._finish(urb, 0)

    def _advance(self) -> None:
        """Let waiting URBs have what the device has for them."""
        self._bus.poll()
        for endpoint, waiting in self._waiting.items():
            while waiting:
                taken = self._bus.take(self._plugged, endpoint, waiting[0].length)
                if taken is None:
                    break
                urb = waiting.popleft()
                urb.data, urb.actual = taken.data, len(taken.data)
                self._settle(urb, taken.error)
                if self._done:
                    break

    def _settle(self, urb: Urb, error: int) -> None:
        """Finish a bulk IN URB, and with it the rest of its transfer where it fell short."""
        short = urb.actual < urb.length and urb.flags & _SHORT_NOT_OK
        if error == errno.ENODEV:
            error = errno.ESHUTDOWN
        elif not error and short:
            error = errno.EREMOTEIO
        self._finish(urb, -error)
        if error:
            self._cut_short.add(urb.endpoint)
            waiting = self._waiting[urb.endpoint]
            while waiting and waiting[0].flags & _CONTINUES:
                self._finish(waiting.popleft(), -errno.ECONNRESET)

    def _finish(self, urb: Urb, status: int) -> None:
        urb.status = status
        self._done.append(urb)
