"""The transport over pyusb: finding cameras by their interfaces, claiming them, bulk
transfers straight into the caller's memory.

pyusb closes a device while another thread reads from it at the price of a crash, so
whoever closes first sees to it that nobody reads.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain

import usb.core
import usb.util
from usb.backend import IBackend, libusb1

from fieldcam.camera.usb3vision.descriptors import (
    INTERFACE_CLASS,
    INTERFACE_SUBCLASS,
    DeviceInfo,
    InterfaceRole,
    parse_device_info,
)
from fieldcam.camera.usb3vision.holders import holder_of
from fieldcam.camera.usb3vision.transport import Bytes, LinkSpeed, TransferTimeout
from fieldcam.camera.usb3vision.usb_faults import usb_faults
from fieldcam.errors import CameraBusy

_DIRECTION_IN = 0x80
_TO_ENDPOINT = 0x02
_SET_FEATURE = 0x03
_ENDPOINT_HALT = 0


@dataclass(frozen=True, slots=True)
class CameraInterfaces:
    """Interface numbers and endpoint addresses of one camera."""

    control: int
    control_out: int
    control_in: int
    stream: int
    stream_in: int
    event: int | None
    event_in: int | None
    info: DeviceInfo | None
    max_power: int
    """As in the configuration: units of 8 mA on USB 3, of 2 mA on USB 2."""

    @property
    def numbers(self) -> tuple[int, ...]:
        numbers = (self.control, self.event, self.stream)
        return tuple(number for number in numbers if number is not None)


def attached(backend: IBackend | None = None) -> Iterator[tuple[usb.core.Device, CameraInterfaces]]:
    """Every attached device that has a camera's interfaces; nothing is opened.

    Each look has a libusb of its own: one that is kept learns of what is plugged in only
    by the system's events, and never of a device whose event was lost.
    """
    with usb_faults():
        for device in _devices(backend or _own_libusb()):
            # A device of another kind may go, or hide its descriptors, while we look.
            with suppress(usb.core.USBError, NotImplementedError):
                if (found := _camera_interfaces(device)) is not None:
                    yield device, found


def _devices(backend: IBackend | None) -> Iterator[usb.core.Device]:
    for device in usb.core.find(find_all=True, backend=backend):
        # libusb has to outlive its devices: of what an object holds, the last goes last.
        device.libusb = device.backend
        yield device


def _own_libusb() -> IBackend | None:
    """None where libusb is not installed, or pyusb found another library instead."""
    shared = libusb1.get_backend()
    return None if shared is None else type(shared)(shared.lib)


def _camera_interfaces(device: usb.core.Device) -> CameraInterfaces | None:
    for configuration in device:
        by_role = _by_role(configuration)
        control, stream = by_role.get(InterfaceRole.CONTROL), by_role.get(InterfaceRole.STREAM)
        if control is None or stream is None:
            continue
        control_out, control_in = _endpoint(control, 0), _endpoint(control, _DIRECTION_IN)
        stream_in = _endpoint(stream, _DIRECTION_IN)
        if control_out is None or control_in is None or stream_in is None:
            continue
        event = by_role.get(InterfaceRole.EVENT)
        return CameraInterfaces(
            control.bInterfaceNumber,
            control_out,
            control_in,
            stream.bInterfaceNumber,
            stream_in,
            None if event is None else event.bInterfaceNumber,
            None if event is None else _endpoint(event, _DIRECTION_IN),
            parse_device_info(_extra_bytes(control)),
            configuration.bMaxPower,
        )
    return None


def _by_role(configuration: usb.core.Configuration) -> dict[int, usb.core.Interface]:
    """The first interface of each role."""
    return {
        interface.bInterfaceProtocol: interface
        for interface in reversed(configuration.interfaces())
        if interface.bInterfaceClass == INTERFACE_CLASS
        and interface.bInterfaceSubClass == INTERFACE_SUBCLASS
    }


def _endpoint(interface: usb.core.Interface, direction: int) -> int | None:
    for endpoint in interface:
        if endpoint.bEndpointAddress & _DIRECTION_IN == direction:
            return endpoint.bEndpointAddress
    return None


def _extra_bytes(interface: usb.core.Interface) -> bytes:
    """Some firmware puts the class-specific descriptor behind the endpoints."""
    behind = chain.from_iterable(endpoint.extra_descriptors for endpoint in interface)
    return bytes(chain(interface.extra_descriptors, behind))


class _Window(array):  # type: ignore[type-arg] # takes none before Python 3.12
    """An array that lies in somebody else's memory.

    pyusb reads into an `array.array` only, whose address it asks for with
    `buffer_info`; so the transfer goes where the caller wants it, without a copy.
    """

    memory: Bytes

    def buffer_info(self) -> tuple[int, int]:
        return self.memory.ctypes.data, self.memory.nbytes


def _window(memory: Bytes) -> _Window:
    window = _Window("B")
    window.memory = memory
    return window


@dataclass(frozen=True, slots=True)
class UsbEndpoint:
    """One bulk endpoint of an open camera."""

    device: usb.core.Device
    address: int

    def write(self, data: bytes, timeout_s: float) -> None:
        with usb_faults():
            count = self.device.write(self.address, data, _milliseconds(timeout_s))
        if count < len(data):
            raise TransferTimeout(f"The camera took {count} of {len(data)} bytes in time.")

    def read(self, into: Bytes, timeout_s: float) -> int:
        with usb_faults():
            return self.device.read(self.address, _window(into), _milliseconds(timeout_s))

    def halt(self) -> None:
        with usb_faults():
            self.device.ctrl_transfer(_TO_ENDPOINT, _SET_FEATURE, _ENDPOINT_HALT, self.address)

    def clear_halt(self) -> None:
        with usb_faults():
            self.device.clear_halt(self.address)


def _milliseconds(timeout_s: float) -> int:
    """At least one: libusb takes zero for ever."""
    return max(1, math.ceil(timeout_s * 1000))


class UsbLink:
    """An open, claimed camera: its endpoints. Closing twice is fine."""

    def __init__(self, device: usb.core.Device, interfaces: CameraInterfaces) -> None:
        """Claims all interfaces; raises CameraBusy, CameraForbidden or CameraUnplugged."""
        self._device = device
        self.control_out = UsbEndpoint(device, interfaces.control_out)
        self.control_in = UsbEndpoint(device, interfaces.control_in)
        self.stream_in = UsbEndpoint(device, interfaces.stream_in)
        self.event_in: UsbEndpoint | None = None
        """Where the camera has an event channel."""
        if interfaces.event_in is not None:
            self.event_in = UsbEndpoint(device, interfaces.event_in)
        self.speed = link_speed(device)
        try:
            _claim(device, interfaces)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Release the camera; no thread may still read from it."""
        usb.util.dispose_resources(self._device)


def _claim(device: usb.core.Device, interfaces: CameraInterfaces) -> None:
    try:
        with usb_faults():
            _configure(device)
            for number in interfaces.numbers:
                # Not every system has kernel drivers to detach.
                with suppress(NotImplementedError):
                    if device.is_kernel_driver_active(number):
                        device.detach_kernel_driver(number)
                usb.util.claim_interface(device, number)
    except CameraBusy as busy:
        raise _busy(device, busy) from busy.__cause__


def _configure(device: usb.core.Device) -> None:
    """Configures only a device that nobody configured: doing it again resets it."""
    try:
        device.get_active_configuration()
    except usb.core.USBError as error:
        if error.errno is not None:
            raise
        device.set_configuration()


def _busy(device: usb.core.Device, busy: CameraBusy) -> CameraBusy:
    holder = None
    if device.bus is not None and device.address is not None:
        holder = holder_of(device.bus, device.address)
    return busy if holder is None else CameraBusy(f"The camera is held by {holder}.", busy.hint)


def link_speed(device: usb.core.Device) -> LinkSpeed:
    """The speed that the bus agreed on; UNKNOWN where the system does not tell."""
    speed = device.speed or 0
    return LinkSpeed(min(speed, LinkSpeed.SUPER_PLUS))


def read_strings(device: usb.core.Device, indices: Sequence[int]) -> list[str]:
    """String descriptors by their indices; empty for 0 and for what cannot be read.

    Opens the device for the time being. Raises CameraForbidden where that is not
    allowed, which pyusb by itself would take for a device without strings.
    """
    try:
        with usb_faults():
            _configure(device)
            return [_string(device, index) for index in indices]
    finally:
        usb.util.dispose_resources(device)


def _string(device: usb.core.Device, index: int) -> str:
    try:
        return (usb.util.get_string(device, index) or "").rstrip("\0 ")
    except ValueError:
        # Neither a language of its own nor valid UTF-16.
        return ""
