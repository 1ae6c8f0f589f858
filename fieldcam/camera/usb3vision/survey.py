"""Every USB device that could be a stereo head, of whatever protocol, by its descriptors."""

from __future__ import annotations

import ctypes
import ctypes.util
import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import usb.core
import usb.util
from usb.backend import IBackend

from fieldcam.camera.usb3vision.descriptor_text import BOS, interface_classes
from fieldcam.camera.usb3vision.devices import port_name
from fieldcam.camera.usb3vision.pyusb_transport import link_speed, read_strings
from fieldcam.camera.usb3vision.transport import LinkSpeed
from fieldcam.camera.usb3vision.usb_faults import usb_faults
from fieldcam.errors import CameraUnplugged, DeviceError

_AUDIO, _HID, _PRINTER, _STORAGE, _HUB, _SMART_CARD, _WIRELESS = 1, 3, 7, 8, 9, 0x0B, 0xE0
NO_HEADS = frozenset((_AUDIO, _HID, _PRINTER, _STORAGE, _HUB, _SMART_CARD, _WIRELESS))
"""Interface classes of what is surely no camera."""

_DEVICE = (
    "<BBHBBBBHHHBBBB",
    "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol "
    "bMaxPacketSize0 idVendor idProduct bcdDevice iManufacturer iProduct iSerialNumber "
    "bNumConfigurations",
)
_CONFIGURATION = (
    "<BBHBBBBB",
    "bLength bDescriptorType wTotalLength bNumInterfaces bConfigurationValue iConfiguration "
    "bmAttributes bMaxPower",
)
_INTERFACE = (
    "<9B",
    "bLength bDescriptorType bInterfaceNumber bAlternateSetting bNumEndpoints bInterfaceClass "
    "bInterfaceSubClass bInterfaceProtocol iInterface",
)
_ENDPOINT = (
    "<BBBBHB",
    "bLength bDescriptorType bEndpointAddress bmAttributes wMaxPacketSize bInterval",
)
_LONG_ENDPOINT = (_ENDPOINT[0] + "BB", _ENDPOINT[1] + " bRefresh bSynchAddress")
_LONG_ENDPOINT_BYTES = 9
_STORE_BYTES = 5
_FROM_DEVICE, _GET_DESCRIPTOR = 0x80, 6


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """One device as its descriptors tell it."""

    usb_id: tuple[int, int]
    """Vendor and product."""
    bus: int
    address: int
    port: str
    """As Linux names the socket."""
    speed: LinkSpeed
    names: tuple[str, ...]
    """Vendor, product and serial number; empty where it does not give them."""
    descriptors: bytes
    """Of the device, then of each configuration with all that belongs to it."""
    object_store: bytes
    """The binary device object store; empty where the device does not give it."""
    trouble: DeviceError | None
    """Why names and object store could not be read."""


@dataclass(frozen=True, slots=True)
class Survey:
    """What is plugged into this machine."""

    candidates: tuple[UsbDevice, ...]
    """By bus and socket."""
    left_out: int
    """Hubs, keyboards, disks and the like."""


def survey_bus(backend: IBackend | None = None) -> Survey:
    """Looks at all USB devices; only those that could be a head are opened, none is claimed.

    Raises UsbLibraryMissing where libusb is not installed.
    """
    found: list[UsbDevice] = []
    left_out = 0
    with usb_faults():
        devices = list(usb.core.find(find_all=True, backend=backend))
    for device in devices:
        # It may go, or hide its descriptors, while we look.
        with suppress(usb.core.USBError, NotImplementedError, CameraUnplugged):
            raw = b"".join(_descriptors(device))
            if interface_classes(raw) <= NO_HEADS:
                left_out += 1
            else:
                found.append(_look_at(device, raw))
    return Survey(tuple(sorted(found, key=lambda each: (each.bus, each.port))), left_out)


def _look_at(device: usb.core.Device, raw: bytes) -> UsbDevice:
    names, store, trouble = [""] * 3, b"", None
    try:
        indices = (device.iManufacturer, device.iProduct, device.iSerialNumber)
        names = read_strings(device, indices)
        store = _object_store(device)
    except CameraUnplugged:
        raise
    except DeviceError as error:
        trouble = error
    return UsbDevice(
        (device.idVendor, device.idProduct),
        device.bus or 0,
        device.address or 0,
        port_name(device.bus or 0, device.port_numbers or ()),
        link_speed(device),
        tuple(names),
        raw,
        store,
        trouble,
    )


def _descriptors(device: usb.core.Device) -> Iterator[bytes]:
    """Put together again from what the library parsed; so the device need not be opened."""
    yield _packed(device, _DEVICE)
    for configuration in device:
        yield _packed(configuration, _CONFIGURATION)
        yield bytes(configuration.extra_descriptors)
        for interface in configuration:
            yield _packed(interface, _INTERFACE)
            yield bytes(interface.extra_descriptors)
            yield from (_endpoint(endpoint) for endpoint in interface)


def _endpoint(endpoint: usb.core.Endpoint) -> bytes:
    """Those of audio devices are longer."""
    short = _packed(endpoint, _ENDPOINT)
    is_long = short[0] >= _LONG_ENDPOINT_BYTES
    own = _packed(endpoint, _LONG_ENDPOINT) if is_long else short
    return own + bytes(endpoint.extra_descriptors)


def _packed(parsed: object, layout: tuple[str, str]) -> bytes:
    form, names = layout
    return struct.pack(form, *(getattr(parsed, name) for name in names.split()))


def _object_store(device: usb.core.Device) -> bytes:
    """Empty where the device has none, as all those before USB 2.1."""
    try:
        head = _ask_for_store(device, _STORE_BYTES)
        return _ask_for_store(device, int.from_bytes(head[2:4], "little"))
    except (usb.core.USBError, NotImplementedError):
        return b""
    finally:
        usb.util.dispose_resources(device)


def _ask_for_store(device: usb.core.Device, length: int) -> bytes:
    return bytes(device.ctrl_transfer(_FROM_DEVICE, _GET_DESCRIPTOR, BOS << 8, 0, length))


class _LibusbVersion(ctypes.Structure):
    """`struct libusb_version`."""

    _fields_ = [
        ("major", ctypes.c_uint16),
        ("minor", ctypes.c_uint16),
        ("micro", ctypes.c_uint16),
        ("nano", ctypes.c_uint16),
        ("rc", ctypes.c_char_p),
        ("describe", ctypes.c_char_p),
    ]


def libusb_version() -> str:
    """Such as 1.0.26; empty where it cannot be told."""
    name = ctypes.util.find_library("usb-1.0")
    if name is None:
        return ""
    try:
        ask = ctypes.CDLL(name).libusb_get_version
    except (OSError, AttributeError):
        return ""
    ask.restype = ctypes.POINTER(_LibusbVersion)
    version = ask().contents
    return f"{version.major}.{version.minor}.{version.micro}"
