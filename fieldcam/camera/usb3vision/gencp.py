"""GenCP packets over USB: commands packed, acknowledgements parsed. Pure.

Little-endian. The layout is that which the aravis, NI and Wireshark sources agree on.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

COMMAND_PREFIX = 0x43563355
"""The bytes `U3VC`."""

HEADER = struct.Struct("<IHHHH")
"""Prefix, flags or status, command, length of the payload, request id."""
_READ = struct.Struct("<QHH")
_ADDRESS = struct.Struct("<Q")
_PENDING = struct.Struct("<HH")

HEADER_BYTES = HEADER.size
WRITE_OVERHEAD_BYTES = HEADER_BYTES + _ADDRESS.size
"""Of a write command, beside its data."""
PENDING_ACK_BYTES = HEADER_BYTES + _PENDING.size

_WITH_ACK = 0x4000


class GencpCommand(IntEnum):
    """What a packet asks for or answers."""

    READ = 0x0800
    READ_ACK = 0x0801
    WRITE = 0x0802
    WRITE_ACK = 0x0803
    PENDING_ACK = 0x0805


class GencpStatus(IntEnum):
    """What a camera answers when it does not do as it was asked."""

    OK = 0x0000
    NOT_IMPLEMENTED = 0x8001
    INVALID_PARAMETER = 0x8002
    INVALID_ADDRESS = 0x8003
    WRITE_PROTECTED = 0x8004
    BAD_ALIGNMENT = 0x8005
    ACCESS_DENIED = 0x8006
    BUSY = 0x8007
    MESSAGE_TIMEOUT = 0x800B
    INVALID_HEADER = 0x800E
    WRONG_CONFIGURATION = 0x800F
    GENERIC_ERROR = 0x8FFF
    RESEND_NOT_SUPPORTED = 0xA001
    ENDPOINT_HALTED = 0xA002
    PAYLOAD_NOT_ALIGNED = 0xA003
    STREAM_REGISTERS_INCONSISTENT = 0xA004
    DATA_DISCARDED = 0xA100
    DATA_OVERRUN = 0xA101


class MalformedPacket(Exception):
    """Bytes that are no packet of the expected kind; the text says in what way."""


@dataclass(frozen=True, slots=True)
class Ack:
    """A camera's answer to one command."""

    status: int
    command: int
    request_id: int
    payload: bytes

    @property
    def is_pending(self) -> bool:
        """The camera works on it and will answer again, under the same request id."""
        return self.command == GencpCommand.PENDING_ACK

    @property
    def pending_s(self) -> float:
        """How long to go on waiting after a pending acknowledgement."""
        _, timeout_ms = _PENDING.unpack_from(self.payload)
        return float(timeout_ms) / 1000


def pack_read(request_id: int, address: int, length: int) -> bytes:
    """A command to read `length` bytes of the camera's memory, at most 65,535."""
    return _command(GencpCommand.READ, request_id, _READ.pack(address, 0, length))


def pack_write(request_id: int, address: int, data: bytes) -> bytes:
    """A command to write `data` into the camera's memory."""
    return _command(GencpCommand.WRITE, request_id, _ADDRESS.pack(address) + data)


def parse_ack(packet: bytes) -> Ack:
    """The acknowledgement in one received transfer; bytes behind it are ignored."""
    if len(packet) < HEADER_BYTES:
        raise MalformedPacket(f"{len(packet)} bytes, too few for a header")
    prefix, status, command, length, request_id = HEADER.unpack_from(packet)
    if prefix != COMMAND_PREFIX:
        raise MalformedPacket(f"a packet that begins with 0x{prefix:08X}")
    payload = packet[HEADER_BYTES : HEADER_BYTES + length]
    if len(payload) < length:
        raise MalformedPacket(f"a packet cut off after {len(packet)} bytes")
    if command == GencpCommand.PENDING_ACK and length < _PENDING.size:
        raise MalformedPacket("a pending acknowledgement without a timeout")
    return Ack(status, command, request_id, payload)


def describe(status: int) -> str:
    """A status in words, as in `access denied (0x8006)`."""
    try:
        words = GencpStatus(status).name.lower().replace("_", " ")
    except ValueError:
        words = "a status of its own"
    return f"{words} (0x{status:04X})"


def _command(command: GencpCommand, request_id: int, payload: bytes) -> bytes:
    header = HEADER.pack(COMMAND_PREFIX, _WITH_ACK, command, len(payload), request_id)
    return header + payload
