"""The event channel: what a camera tells by itself, such as the end of an exposure."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from fieldcam.camera.genapi.registers import Registers
from fieldcam.camera.usb3vision.bootstrap import Eirm, write_u32
from fieldcam.camera.usb3vision.gencp import HEADER, MalformedPacket
from fieldcam.camera.usb3vision.transport import (
    MAX_PACKET_BYTES,
    BulkIn,
    TransferTimeout,
    round_up,
)

EVENT_PREFIX = 0x45563355
"""The bytes `U3VE`."""
EVENT_COMMAND = 0x0C00

_EVENT = struct.Struct("<HHQ")
_LONGEST_EVENT_BYTES = 1 << 16


@dataclass(frozen=True, slots=True)
class CameraEvent:
    """One event of a camera."""

    number: int
    """Up to 0x8000 those of the standard, from 0x9000 on the maker's."""
    timestamp_ns: int
    """The camera's own clock."""
    data: bytes


def parse_event(packet: bytes) -> CameraEvent:
    """The event in one received transfer; raises MalformedPacket for anything else."""
    if len(packet) < HEADER.size + _EVENT.size:
        raise MalformedPacket(f"{len(packet)} bytes, too few for an event")
    prefix, _, command, length, _ = HEADER.unpack_from(packet)
    if (prefix, command) != (EVENT_PREFIX, EVENT_COMMAND):
        raise MalformedPacket(f"a packet that begins with 0x{prefix:08X}")
    end = HEADER.size + length
    if not _EVENT.size <= length <= len(packet) - HEADER.size:
        raise MalformedPacket(f"an event of {length} bytes in a packet of {len(packet)}")
    _, number, timestamp_ns = _EVENT.unpack_from(packet, HEADER.size)
    return CameraEvent(number, timestamp_ns, packet[HEADER.size + _EVENT.size : end])


class EventChannel:
    """The events of one open camera; one thread at a time reads them."""

    def __init__(self, pipe: BulkIn, registers: Registers, eirm: Eirm) -> None:
        self._pipe = pipe
        self._registers = registers
        self._address = eirm.address
        longest = min(max(eirm.event_bytes, 1), _LONGEST_EVENT_BYTES)
        self._buffer = np.empty(round_up(longest, MAX_PACKET_BYTES), np.uint8)

    def enable(self) -> None:
        """Which events are sent is set through the camera's features."""
        write_u32(self._registers, self._address, 1)

    def receive(self, timeout_s: float) -> CameraEvent | None:
        """The next event; None where none came in time, and for bytes that are none."""
        try:
            count = self._pipe.read(self._buffer, timeout_s)
            return parse_event(self._buffer[:count].tobytes())
        except (TransferTimeout, MalformedPacket):
            return None
