"""The kernel's side of an opened USB device file, for one process under umockdev's preload.

The preload sends each ioctl over a Unix socket as three 64-bit words and lets the
other end read and write the caller's memory before it answers (umockdev 0.17).
"""

from __future__ import annotations

import errno
import socket
import struct
import threading
from contextlib import suppress

from .bus import Plugged, UsbBus
from .claims import INTERFACES, Claims
from .descriptors import Speed
from .faults import Fault, Faults
from .urbs import URB, Urb, UrbQueue
from .usb_device import clear_halt

_WORDS = struct.Struct("<QQQ")
_IOCTL, _DONE, _READ_MEMORY, _WRITE_MEMORY = 1, 3, 5, 6
_NOT_HANDLED = -100 & 0xFFFF_FFFF_FFFF_FFFF
_FAILED = 0xFFFF_FFFF_FFFF_FFFF
_USB = ord("U")
_SPEEDS = {Speed.HIGH: 3, Speed.SUPER: 5}
"""As of `enum usb_device_speed`."""
_PAUSE_S = 0.0005
"""The preload's device files are always ready to poll; without this libusb would spin."""
_LONG_PAUSE_S = 0.002
_ASKED_ANYWAY, _IMPATIENT = 2, 40
WHOLE, IN_PIECES = 0x1F, 0x13
"""Capabilities: a long transfer is one URB, or one for every 16 KiB."""


class _Hangup(Exception):
    """The process has closed the file."""


class UsbfsFile(threading.Thread):
    """Serves one opened file until it is closed."""

    def __init__(
        self,
        connection: socket.socket,
        bus: UsbBus,
        plugged: Plugged,
        capabilities: int,
        limit_bytes: int,
        claims: Claims,
    ) -> None:
        super().__init__(name="usbfs", daemon=True)
        self._connection = connection
        self._bus = bus
        self._plugged = plugged
        self._capabilities = capabilities
        self._claims = claims
        self._urbs = UrbQueue(bus, plugged, limit_bytes)
        self._asked_in_vain = 0
        self._calls = {
            3: self._nothing,
            4: self._nothing,
            5: self._nothing,
            8: self._driver,
            10: self._submit,
            11: self._discard,
            13: self._reap,
            15: self._claim,
            16: self._release,
            18: self._driver_ioctl,
            20: self._reset,
            21: self._clear_halt,
            22: self._detach,
            23: self._nothing,
            26: self._tell_capabilities,
            27: self._claim_from_driver,
            31: self._speed,
        }

    def run(self) -> None:
        try:
            with self._connection, suppress(_Hangup, ConnectionError):
                while True:
                    kind, request, argument = _WORDS.unpack(self._received(_WORDS.size))
                    self._answer(kind, request, argument)
        finally:
            self._claims.drop(self)

    def close(self) -> None:
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)

    def _answer(self, kind: int, request: int, argument: int) -> None:
        if kind != _IOCTL:
            self._send(_WORDS.pack(_DONE, _NOT_HANDLED, 0))
            return
        call = self._calls.get(request & 0xFF) if request >> 8 & 0xFF == _USB else None
        result = call(argument) if call else -errno.ENOTTY
        if result < 0:
            self._send(_WORDS.pack(_DONE, _FAILED, -result))
        else:
            self._send(_WORDS.pack(_DONE, result, 0))

    # Each call takes the ioctl's argument and gives its result, or minus an errno.

    def _nothing(self, argument: int) -> int:
        return 0 if self._bus.is_plugged(self._plugged) else -errno.ENODEV

    def _driver(self, argument: int) -> int:
        """(interface, name)"""
        if self._faults.armed(Fault.KERNEL_DRIVER):
            self._write(argument + 4, b"u3v\0")
            return 0
        if self._claims.is_held(self._plugged, self._number(argument)):
            self._write(argument + 4, b"usbfs\0")
            return 0
        return -errno.ENODATA

    def _submit(self, argument: int) -> int:
        urb = Urb.parse(argument, self._read(argument, URB.size))
        if not self._may_use(urb.endpoint):
            return -errno.EBUSY
        data = self._read(urb.buffer, urb.length) if urb.wants_data else b""
        return -self._urbs.submit(urb, data)

    def _discard(self, argument: int) -> int:
        return -self._urbs.discard(argument)

    def _reap(self, argument: int) -> int:
        urb = self._urbs.reap()
        if urb is None:
            return self._later()
        self._asked_in_vain = 0
        parts: list[bytes | memoryview] = []
        if urb.data:
            parts += [_WORDS.pack(_WRITE_MEMORY, urb.data_at, len(urb.data)), urb.data]
        for address, data in ((urb.address, urb.finished()), (argument, _word(urb.address))):
            parts += [_WORDS.pack(_WRITE_MEMORY, address, len(data)), data]
        self._send(*parts)
        return 0

    def _later(self) -> int:
        """Nothing is done yet: say so, when asked again and again after a little while.

        libusb asks twice more after each URB that it got, and only then goes on.
        """
        if not self._bus.is_plugged(self._plugged):
            return -errno.ENODEV
        if self._asked_in_vain >= _ASKED_ANYWAY:
            pause_s = _PAUSE_S if self._asked_in_vain < _IMPATIENT else _LONG_PAUSE_S
            with self._bus.changed:
                self._bus.changed.wait(pause_s)
        self._asked_in_vain += 1
        return -errno.EAGAIN

    def _claim(self, argument: int) -> int:
        if not self._bus.is_plugged(self._plugged):
            return -errno.ENODEV
        if self._faults.armed(Fault.KERNEL_DRIVER) or self._faults.strikes(Fault.IN_USE):
            return -errno.EBUSY
        claimed = self._claims.take(self._plugged, self._number(argument), self)
        return 0 if claimed else -errno.EBUSY

    def _release(self, argument: int) -> int:
        released = self._claims.give_back(self._plugged, self._number(argument), self)
        return 0 if released else -errno.EINVAL

    def _may_use(self, endpoint: int) -> bool:
        """The kernel claims the interface of an endpoint that is used without that."""
        interface = INTERFACES.get(endpoint)
        return interface is None or self._claims.take(self._plugged, interface, self)

    def _claim_from_driver(self, argument: int) -> int:
        self._faults.disarm(Fault.KERNEL_DRIVER)
        return self._claim(argument)

    def _driver_ioctl(self, argument: int) -> int:
        """(interface, code, data): the codes are those of detaching and attaching a driver."""
        _, code = struct.unpack("<II", self._read(argument, 8))
        call = {22: self._detach, 23: self._nothing}.get(code & 0xFF)
        return call(argument) if call else -errno.ENOTTY

    def _detach(self, argument: int) -> int:
        if not self._faults.armed(Fault.KERNEL_DRIVER):
            return -errno.ENODATA
        self._faults.disarm(Fault.KERNEL_DRIVER)
        return 0

    def _reset(self, argument: int) -> int:
        if self._claims.others_hold(self._plugged, self):
            return -errno.EACCES
        with self._bus.changed:
            self._plugged.function.powered(self._plugged.speed, self._bus.clock.now_ns())
        return 0

    def _clear_halt(self, argument: int) -> int:
        endpoint = self._number(argument)
        if not self._may_use(endpoint):
            return -errno.EBUSY
        with self._bus.changed:
            clear_halt(self._plugged.function, endpoint)
        return 0

    def _tell_capabilities(self, argument: int) -> int:
        self._write(argument, struct.pack("<I", self._capabilities))
        return 0

    def _speed(self, argument: int) -> int:
        return _SPEEDS[self._plugged.speed]

    @property
    def _faults(self) -> Faults:
        return self._plugged.function.faults

    def _number(self, address: int) -> int:
        (number,) = struct.unpack("<I", self._read(address, 4))
        return int(number)

    def _read(self, address: int, count: int) -> bytes:
        """The client's memory."""
        self._send(_WORDS.pack(_READ_MEMORY, address, count))
        return self._received(count)

    def _write(self, address: int, data: bytes) -> None:
        self._send(_WORDS.pack(_WRITE_MEMORY, address, len(data)), data)

    def _received(self, count: int) -> bytes:
        found = b""
        while len(found) < count:
            piece = self._connection.recv(count - len(found))
            if not piece:
                raise _Hangup
            found += piece
        return found

    def _send(self, *parts: bytes | memoryview) -> None:
        for part in parts:
            self._connection.sendall(part)


def _word(value: int) -> bytes:
    return struct.pack("<Q", value)
