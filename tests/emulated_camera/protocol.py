"""Numbers of the USB3 Vision protocol, as a camera needs them; all fields little-endian.

Sources: the public hosts and devices listed in `docs/camera.md`.
"""

from __future__ import annotations

import struct
from enum import IntEnum

CONTROL_PREFIX = 0x43563355
EVENT_PREFIX = 0x45563355
LEADER_PREFIX = 0x4C563355
TRAILER_PREFIX = 0x54563355

HEADER = struct.Struct("<IHHHH")
"""Of a command, an ack or an event: prefix, flags or status, id, payload length, request id."""
READ_REQUEST = struct.Struct("<QHH")
WRITE_ADDRESS = struct.Struct("<Q")
PENDING = struct.Struct("<HH")
EVENT = struct.Struct("<HHQ")
LEADER = struct.Struct("<IHHQHHQIIIIIHH")
TRAILER = struct.Struct("<IHHQHHQI")
CHUNK_LAYOUT = struct.Struct("<I")
CHUNK_TAIL = struct.Struct("<II")
"""Behind the data of a chunk: its id and length."""

ACK_WANTED = 0x4000


class Command(IntEnum):
    """What a host may send on the control channel, and the acks to it."""

    READ = 0x0800
    READ_ACK = 0x0801
    WRITE = 0x0802
    WRITE_ACK = 0x0803
    PENDING_ACK = 0x0805
    EVENT = 0x0C00


class Status(IntEnum):
    """Of an ack, or in a trailer."""

    SUCCESS = 0x0000
    NOT_IMPLEMENTED = 0x8001
    INVALID_PARAMETER = 0x8002
    INVALID_ADDRESS = 0x8003
    WRITE_PROTECT = 0x8004
    BAD_ALIGNMENT = 0x8005
    ACCESS_DENIED = 0x8006
    BUSY = 0x8007
    INVALID_HEADER = 0x800E
    PAYLOAD_NOT_ALIGNED = 0xA003
    SIZES_INCONSISTENT = 0xA004
    DATA_DISCARDED = 0xA100
    DATA_OVERRUN = 0xA101


class Payload(IntEnum):
    """What a leader announces."""

    IMAGE = 0x0001
    IMAGE_WITH_CHUNKS = 0x4001


class Format(IntEnum):
    """Pixel formats (PFNC) that the emulated sensors have."""

    MONO8 = 0x01080001
    BAYER_RG8 = 0x01080009


class Abrm(IntEnum):
    """Offsets of the bootstrap registers that every GenCP device has, from address 0."""

    GENCP_VERSION = 0x000
    MANUFACTURER = 0x004
    MODEL = 0x044
    FAMILY = 0x084
    DEVICE_VERSION = 0x0C4
    MANUFACTURER_INFO = 0x104
    SERIAL = 0x144
    USER_NAME = 0x184
    CAPABILITY = 0x1C4
    MAX_RESPONSE_MS = 0x1CC
    MANIFEST = 0x1D0
    SBRM = 0x1D8
    CONFIGURATION = 0x1E0
    HEARTBEAT = 0x1E8
    MESSAGE_CHANNEL = 0x1EC
    TIMESTAMP = 0x1F0
    TIMESTAMP_LATCH = 0x1F8
    TIMESTAMP_INCREMENT = 0x1FC
    ACCESS_PRIVILEGE = 0x204
    PROTOCOL_ENDIANNESS = 0x208
    IMPLEMENTATION_ENDIANNESS = 0x20C


class Sbrm(IntEnum):
    """Offsets of the registers of the technology."""

    VERSION = 0x00
    CAPABILITY = 0x04
    CONFIGURATION = 0x0C
    MAX_COMMAND = 0x14
    MAX_ACK = 0x18
    STREAM_CHANNELS = 0x1C
    SIRM = 0x20
    SIRM_LENGTH = 0x28
    EIRM = 0x2C
    EIRM_LENGTH = 0x34
    IIDC2 = 0x38
    SPEED = 0x40


class Sirm(IntEnum):
    """Offsets of the stream interface's registers."""

    INFO = 0x00
    CONTROL = 0x04
    REQUIRED_PAYLOAD = 0x08
    REQUIRED_LEADER = 0x10
    REQUIRED_TRAILER = 0x14
    MAX_LEADER = 0x18
    PAYLOAD_SIZE = 0x1C
    PAYLOAD_COUNT = 0x20
    FINAL_1 = 0x24
    FINAL_2 = 0x28
    MAX_TRAILER = 0x2C


class Eirm(IntEnum):
    """Offsets of the event interface's registers."""

    CONTROL = 0x00
    MAX_EVENT = 0x04
    TEST = 0x08


TEST_EVENT = 0x4FFF
EXPOSURE_END_EVENT = 0x9001
SHUTTER_EVENT = 0x9002
