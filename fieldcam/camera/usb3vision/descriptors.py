"""The class-specific descriptor of a USB3 Vision camera and the roles of its interfaces.

The layout is that which the aravis and Infineon FX20 sources agree on.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

INTERFACE_CLASS = 0xEF
INTERFACE_SUBCLASS = 0x05

_CLASS_SPECIFIC_INTERFACE = 0x24
_DEVICE_INFO = 0x01
_LAYOUT = struct.Struct("<BBB 2H 2H 8B B")


class InterfaceRole(IntEnum):
    """What an interface of the camera is for: its bInterfaceProtocol."""

    CONTROL = 0
    EVENT = 1
    STREAM = 2


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """What the class-specific descriptor says; 0 where a camera left a field out.

    Versions are (major, minor). The other numbers are indices of string descriptors.
    """

    gencp_version: tuple[int, int]
    u3v_version: tuple[int, int]
    guid_index: int
    vendor_index: int
    model_index: int
    family_index: int
    device_version_index: int
    manufacturer_info_index: int
    serial_index: int
    user_name_index: int
    speed_support: int
    """Bit 0 low, 1 full, 2 high, 3 super speed, the rest faster ones."""


def parse_device_info(extra: bytes) -> DeviceInfo | None:
    """The camera's descriptor among those that follow an interface; None where it has none.

    Some cameras cut it short or leave it zero: what is missing reads as 0.
    """
    for descriptor in _split(extra):
        if descriptor[1:3] == bytes((_CLASS_SPECIFIC_INTERFACE, _DEVICE_INFO)):
            fields = _LAYOUT.unpack(descriptor[: _LAYOUT.size].ljust(_LAYOUT.size, b"\0"))
            gencp_minor, gencp_major, u3v_minor, u3v_major, *rest = fields[3:]
            return DeviceInfo((gencp_major, gencp_minor), (u3v_major, u3v_minor), *rest)
    return None


def _split(extra: bytes) -> Iterator[bytes]:
    """Each descriptor begins with its own length."""
    position = 0
    while position < len(extra) and extra[position] >= 3:
        yield extra[position : position + extra[position]]
        position += extra[position]
