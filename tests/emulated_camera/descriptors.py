"""The USB descriptors of the emulated camera, as the bytes that a device sends.

Layout by the USB 2.0 and 3.2 specifications, chapter 9; the class-specific
descriptor by what public hosts read.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum

DEVICE, CONFIGURATION, STRING, INTERFACE, ENDPOINT, BOS = 1, 2, 3, 4, 5, 15
CONTROL_OUT, CONTROL_IN, EVENT_IN, STREAM_IN = 0x01, 0x81, 0x82, 0x83
CONTROL_INTERFACE, EVENT_INTERFACE, STREAM_INTERFACE = 0, 1, 2
_ASSOCIATION, _COMPANION, _VISION = 11, 48, 0x24
_BULK = 2
_LANGUAGE_US_ENGLISH = 0x0409
_MISCELLANEOUS, _VISION_SUBCLASS = 0xEF, 0x05


class Speed(Enum):
    """Of the link, in Mbit/s as the kernel gives it."""

    HIGH = 480
    SUPER = 5000

    @property
    def packet_bytes(self) -> int:
        """Of a bulk endpoint."""
        return 512 if self is Speed.HIGH else 1024

    @property
    def code(self) -> int:
        """Its bit in the register of the current speed."""
        return 4 if self is Speed.HIGH else 8

    @property
    def bytes_per_s(self) -> float:
        """What a bulk endpoint gets over such a link in practice."""
        return 42e6 if self is Speed.HIGH else 450e6


@dataclass(frozen=True, slots=True)
class Identity:
    """Who a camera says that it is."""

    serial: str
    vendor: str = "Emulated Optics"
    model: str = "Flash Eye 1440"
    family: str = "Flash Eye"
    version: str = "1.0"
    info: str = "made of software"
    user_name: str = ""
    vendor_id: int = 0x1209
    product_id: int = 0x5533
    power_ma: int = 896
    """What it asks for on a SuperSpeed port."""

    @property
    def guid(self) -> str:
        return f"{self.vendor_id:04X}{sum(self.serial.encode()) & 0xFFFF:04X}{self.serial[-4:]:>04}"

    @property
    def strings(self) -> tuple[str, ...]:
        """By their index less one."""
        return (
            self.vendor,
            self.model,
            self.serial,
            self.guid,
            self.family,
            self.version,
            self.info,
            self.user_name or self.model,
        )


def device(identity: Identity, speed: Speed) -> bytes:
    """The device descriptor."""
    super_speed = speed is Speed.SUPER
    return struct.pack(
        "<BBHBBBBHHHBBBB",
        18,
        DEVICE,
        0x0300 if super_speed else 0x0210,
        _MISCELLANEOUS,
        0x02,
        0x01,
        9 if super_speed else 64,
        identity.vendor_id,
        identity.product_id,
        0x0100,
        1,
        2,
        3,
        1,
    )


def configuration(identity: Identity, speed: Speed) -> bytes:
    """The configuration with its three interfaces."""
    unit_ma = 8 if speed is Speed.SUPER else 2
    power = min(identity.power_ma, 500 if speed is Speed.HIGH else 900) // unit_ma
    body = (
        struct.pack("<8B", 8, _ASSOCIATION, 0, 3, _MISCELLANEOUS, _VISION_SUBCLASS, 0, 0)
        + _interface(CONTROL_INTERFACE, 2)
        + _vision()
        + _endpoint(CONTROL_IN, speed)
        + _endpoint(CONTROL_OUT, speed)
        + _interface(EVENT_INTERFACE, 1)
        + _endpoint(EVENT_IN, speed)
        + _interface(STREAM_INTERFACE, 1)
        + _endpoint(STREAM_IN, speed)
    )
    return struct.pack("<BBHBBBBB", 9, CONFIGURATION, 9 + len(body), 3, 1, 0, 0x80, power) + body


def _interface(number: int, endpoints: int) -> bytes:
    """The protocol of an interface (control, event, stream) is its number here."""
    kind = (_MISCELLANEOUS, _VISION_SUBCLASS, number)
    return struct.pack("<9B", 9, INTERFACE, number, 0, endpoints, *kind, 0)


def _endpoint(address: int, speed: Speed) -> bytes:
    found = struct.pack("<BBBBHB", 7, ENDPOINT, address, _BULK, speed.packet_bytes, 0)
    if speed is Speed.SUPER:
        found += struct.pack("<BBBBH", 6, _COMPANION, 15, 0, 0)
    return found


def _vision() -> bytes:
    """Versions, then the string indices of GUID, vendor, model, family, version, info, serial."""
    return struct.pack("<BBBHHHH9B", 20, _VISION, 0x01, 0, 1, 0, 1, 4, 1, 2, 5, 6, 7, 3, 8, 0x0C)


def string(identity: Identity, index: int) -> bytes | None:
    """A string descriptor; None where there is none of this index."""
    if index == 0:
        return struct.pack("<BBH", 4, STRING, _LANGUAGE_US_ENGLISH)
    if index > len(identity.strings):
        return None
    text = identity.strings[index - 1].encode("utf-16-le")
    return struct.pack("<BB", 2 + len(text), STRING) + text


def binary_object_store() -> bytes:
    """What every device of USB 2.1 or later has: link power management and speeds."""
    power = struct.pack("<BBBI", 7, 16, 2, 2)
    speeds = struct.pack("<BBBBHBBH", 10, 16, 3, 0, 0x000C, 2, 10, 100)
    return struct.pack("<BBHB", 5, BOS, 5 + len(power) + len(speeds), 2) + power + speeds
