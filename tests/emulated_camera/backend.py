"""Emulated cameras under pyusb, in the same process: `usb.core.find(backend=EmulatedBackend(bus))`.

The errors are those that pyusb gives over libusb: an errno each, and USBTimeoutError
where nothing came.
"""

from __future__ import annotations

import ctypes
import errno
import os
import struct
from array import array
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import usb.backend
import usb.core

from . import descriptors
from .bus import Plugged, UsbBus
from .descriptors import Speed
from .faults import Fault
from .usb_device import Setup, Stalled, clear_halt, control

_WAIT_NS = 500_000
"""Free-running cameras expose when they are asked, so a waiting host asks this often."""
_SPEEDS = {Speed.HIGH: 3, Speed.SUPER: 4}
_DEVICE = (
    "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol "
    "bMaxPacketSize0 idVendor idProduct bcdDevice iManufacturer iProduct iSerialNumber "
    "bNumConfigurations"
)
_CONFIGURATION = (
    "bLength bDescriptorType wTotalLength bNumInterfaces bConfigurationValue iConfiguration "
    "bmAttributes bMaxPower"
)
_INTERFACE = (
    "bLength bDescriptorType bInterfaceNumber bAlternateSetting bNumEndpoints bInterfaceClass "
    "bInterfaceSubClass bInterfaceProtocol iInterface"
)
_ENDPOINT = "bLength bDescriptorType bEndpointAddress bmAttributes wMaxPacketSize bInterval"


class Handle:
    """An opened device."""

    def __init__(self, plugged: Plugged) -> None:
        self.plugged = plugged
        self.claimed: set[int] = set()


class EmulatedBackend(usb.backend.IBackend):
    """What pyusb asks of libusb, answered by the devices on a bus."""

    def __init__(self, bus: UsbBus) -> None:
        super().__init__()
        self.bus = bus
        self.open_handles = 0

    def enumerate_devices(self) -> Iterator[Plugged]:
        self.bus.poll()
        return iter(self.bus.plugged)

    def get_parent(self, dev: Plugged) -> None:
        return None

    def get_device_descriptor(self, dev: Plugged) -> SimpleNamespace:
        raw = descriptors.device(dev.function.identity, dev.speed)
        found = _named(_DEVICE, struct.unpack("<BBHBBBBHHHBBBB", raw))
        found.bus, found.address = dev.bus_number, dev.address
        found.port_number, found.port_numbers = dev.port, (dev.port,)
        found.speed = _SPEEDS[dev.speed]
        return found

    def get_configuration_descriptor(self, dev: Plugged, config: int) -> SimpleNamespace:
        if config != 0:
            raise IndexError(config)
        return _configuration(dev)

    def get_interface_descriptor(
        self, dev: Plugged, intf: int, alt: int, config: int
    ) -> SimpleNamespace:
        interfaces = self.get_configuration_descriptor(dev, config).interfaces
        if alt != 0:
            raise IndexError(alt)
        found: SimpleNamespace = interfaces[intf]
        return found

    def get_endpoint_descriptor(
        self, dev: Plugged, ep: int, intf: int, alt: int, config: int
    ) -> SimpleNamespace:
        found: SimpleNamespace = self.get_interface_descriptor(dev, intf, alt, config).endpoints[ep]
        return found

    def open_device(self, dev: Plugged) -> Handle:
        if not self.bus.is_plugged(dev):
            raise _error(errno.ENODEV)
        if not dev.permitted:
            raise _error(errno.EACCES)
        self.open_handles += 1
        return Handle(dev)

    def close_device(self, dev_handle: Handle) -> None:
        self.open_handles -= 1

    def set_configuration(self, dev_handle: Handle, config_value: int) -> None:
        self._present(dev_handle)
        if dev_handle.claimed:
            raise _error(errno.EBUSY)

    def get_configuration(self, dev_handle: Handle) -> int:
        self._present(dev_handle)
        return 1

    def set_interface_altsetting(self, dev_handle: Handle, intf: int, altsetting: int) -> None:
        self._present(dev_handle)

    def claim_interface(self, dev_handle: Handle, intf: int) -> None:
        faults = self._present(dev_handle).function.faults
        if faults.armed(Fault.KERNEL_DRIVER) or faults.strikes(Fault.IN_USE):
            raise _error(errno.EBUSY)
        dev_handle.claimed.add(intf)

    def release_interface(self, dev_handle: Handle, intf: int) -> None:
        dev_handle.claimed.discard(intf)

    def bulk_write(
        self, dev_handle: Handle, ep: int, intf: int, data: array[int], timeout: int
    ) -> int:
        _check(self.bus.send(dev_handle.plugged, ep, data.tobytes()))
        return len(data) * data.itemsize

    def bulk_read(
        self, dev_handle: Handle, ep: int, intf: int, buff: array[int], timeout: int
    ) -> int:
        address, count = buff.buffer_info()
        length = count * buff.itemsize
        if dev_handle.plugged.function.faults.strikes(Fault.NO_MEMORY):
            raise _error(errno.ENOMEM)
        deadline_ns = self.bus.clock.now_ns() + timeout * 1_000_000
        while (taken := self.bus.take(dev_handle.plugged, ep, length)) is None:
            if timeout and self.bus.clock.now_ns() >= deadline_ns:
                raise usb.core.USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)
            with self.bus.changed:
                self.bus.clock.wait(self.bus.changed, _WAIT_NS)
        if taken.data:
            source = np.frombuffer(taken.data, np.uint8)
            ctypes.memmove(address, source.ctypes.data, source.size)
        _check(taken.error)
        return len(taken.data)

    def ctrl_transfer(
        self,
        dev_handle: Handle,
        bmRequestType: int,
        bRequest: int,
        wValue: int,
        wIndex: int,
        data: array[int],
        timeout: int,
    ) -> int:
        plugged = self._present(dev_handle)
        setup = Setup(bmRequestType, bRequest, wValue, wIndex, len(data) * data.itemsize)
        try:
            with self.bus.changed:
                answer = control(plugged.function, plugged.speed, setup)
        except Stalled as stalled:
            raise _error(errno.EPIPE) from stalled
        if bmRequestType & 0x80:
            data[: len(answer)] = array("B", answer)
            return len(answer)
        return setup.length

    def clear_halt(self, dev_handle: Handle, ep: int) -> None:
        with self.bus.changed:
            clear_halt(self._present(dev_handle).function, ep)

    def reset_device(self, dev_handle: Handle) -> None:
        plugged = self._present(dev_handle)
        with self.bus.changed:
            plugged.function.powered(plugged.speed, self.bus.clock.now_ns())

    def is_kernel_driver_active(self, dev_handle: Handle, intf: int) -> bool:
        return self._present(dev_handle).function.faults.armed(Fault.KERNEL_DRIVER)

    def detach_kernel_driver(self, dev_handle: Handle, intf: int) -> None:
        self._present(dev_handle).function.faults.disarm(Fault.KERNEL_DRIVER)

    def attach_kernel_driver(self, dev_handle: Handle, intf: int) -> None:
        self._present(dev_handle)

    def _present(self, handle: Handle) -> Plugged:
        self.bus.poll()
        if not self.bus.is_plugged(handle.plugged):
            raise _error(errno.ENODEV)
        return handle.plugged


_LIBUSB = {
    errno.EIO: -1,
    errno.EACCES: -3,
    errno.ENODEV: -4,
    errno.EBUSY: -6,
    errno.EOVERFLOW: -8,
    errno.EPIPE: -9,
    errno.ENOMEM: -11,
}


def _check(number: int) -> None:
    if number:
        raise _error(errno.EIO if number == errno.EPROTO else number)


def _error(number: int) -> usb.core.USBError:
    return usb.core.USBError(os.strerror(number), _LIBUSB[number], number)


def _named(names: str, values: tuple[int, ...]) -> SimpleNamespace:
    return SimpleNamespace(**dict(zip(names.split(), values, strict=True)))


def _configuration(plugged: Plugged) -> SimpleNamespace:
    """The configuration parsed from its bytes, with `interfaces` and their `endpoints`."""
    raw = descriptors.configuration(plugged.function.identity, plugged.speed)
    found = _named(_CONFIGURATION, struct.unpack_from("<BBHBBBBB", raw))
    found.interfaces = []
    found.extra_descriptors = []
    last = found
    for one in _each(raw[9:]):
        if one[1] == descriptors.INTERFACE:
            last = _named(_INTERFACE, struct.unpack("<9B", one))
            last.endpoints, last.extra_descriptors = [], []
            found.interfaces.append(last)
        elif one[1] == descriptors.ENDPOINT:
            last = _named(_ENDPOINT, struct.unpack("<BBBBHB", one))
            last.bRefresh = last.bSynchAddress = 0
            last.extra_descriptors = []
            found.interfaces[-1].endpoints.append(last)
        else:
            last.extra_descriptors += list(one)
    return found


def _each(raw: bytes) -> Iterator[bytes]:
    while raw:
        yield raw[: raw[0]]
        raw = raw[raw[0] :]
