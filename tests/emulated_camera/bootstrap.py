"""The bootstrap registers and the manifest, at addresses that only pointers lead to."""

from __future__ import annotations

import hashlib
import io
import struct
import zipfile
from enum import Enum

from .control import MAX_ACK_BYTES, MAX_COMMAND_BYTES
from .descriptors import Identity, Speed
from .framing import TransferSizes
from .protocol import CHUNK_LAYOUT, LEADER, TRAILER, Abrm, Eirm, Sbrm, Sirm, Status
from .registers import TEXT_LENGTH, Access, AddressSpace, Block, Refused, Register

SBRM, SIRM, EIRM = 0x0005_0000, 0x0006_2000, 0x0006_4000
MANIFEST, FILE = 0x0100_0000, 0x0110_0000
ALIGNMENT_LOG2 = 10
"""Transfer sizes are multiples of 1 KiB."""
MAX_RESPONSE_MS = 100
_GENCP_1_1, _VISION_1_0 = 0x0001_0001, 0x0001_0000
_USER_NAME, _MESSAGE_CHANNEL, _TIMESTAMP, _FAMILY = 1 << 0, 1 << 2, 1 << 3, 1 << 8
_HAS_SBRM, _ENDIANNESS, _WRITTEN_LENGTH = 1 << 9, 1 << 10, 1 << 11
_STREAM_AND_EVENTS = 0b11


class FileKind(Enum):
    """How the XML lies in the camera, by the number in the manifest."""

    PLAIN = 0
    ZIPPED = 1


class Bootstrap:
    """Makes the registers, and reads and writes those that the camera works with."""

    def __init__(self, identity: Identity, xml: bytes, kind: FileKind, space: AddressSpace) -> None:
        self._abrm = _abrm(identity, space)
        self._sbrm = _sbrm(space)
        self._sirm = _sirm(space)
        self._eirm = _eirm(space)
        _manifest(xml, kind, space)

    def abrm(self, offset: Abrm) -> Register:
        return self._abrm[offset]

    def sirm(self, offset: Sirm) -> Register:
        return self._sirm[offset]

    @property
    def streaming(self) -> bool:
        return bool(self._sirm[Sirm.CONTROL].integer & 1)

    @property
    def sends_events(self) -> bool:
        return bool(self._eirm[Eirm.CONTROL].integer & 1)

    @property
    def test_event(self) -> Register:
        return self._eirm[Eirm.TEST]

    @property
    def sizes(self) -> TransferSizes:
        names = (Sirm.PAYLOAD_SIZE, Sirm.PAYLOAD_COUNT, Sirm.FINAL_1, Sirm.FINAL_2)
        return TransferSizes(*(self._sirm[name].integer for name in names))

    def powered(self, speed: Speed) -> None:
        """Forget what a host has set."""
        self._sbrm[Sbrm.SPEED].integer = speed.code
        for register in (*self._sirm.values(), *self._eirm.values()):
            if register.access is Access.RW:
                register.integer = 0


def _checked_sizes(sirm: dict[int, Register], data: bytes) -> None:
    """Refuse to stream with sizes that do not fit together."""
    if not data[0] & 1:
        return
    names = (Sirm.PAYLOAD_SIZE, Sirm.PAYLOAD_COUNT, Sirm.FINAL_1, Sirm.FINAL_2)
    sizes = TransferSizes(*(sirm[name].integer for name in names))
    if any(n % (1 << ALIGNMENT_LOG2) for n in (sizes.payload, sizes.final_1, sizes.final_2)):
        raise Refused(Status.PAYLOAD_NOT_ALIGNED)
    short = sizes.total < sirm[Sirm.REQUIRED_PAYLOAD].integer
    leader = sirm[Sirm.MAX_LEADER].integer < sirm[Sirm.REQUIRED_LEADER].integer
    trailer = sirm[Sirm.MAX_TRAILER].integer < sirm[Sirm.REQUIRED_TRAILER].integer
    if short or leader or trailer:
        raise Refused(Status.SIZES_INCONSISTENT)


def _abrm(identity: Identity, space: AddressSpace) -> dict[int, Register]:
    block = space.add(0, 0x1000)
    texts = {
        Abrm.MANUFACTURER: identity.vendor,
        Abrm.MODEL: identity.model,
        Abrm.FAMILY: identity.family,
        Abrm.DEVICE_VERSION: identity.version,
        Abrm.MANUFACTURER_INFO: identity.info,
        Abrm.SERIAL: identity.serial,
    }
    found: dict[int, Register] = {
        offset: _fixed(block, offset, text.encode().ljust(TEXT_LENGTH, b"\0"))
        for offset, text in texts.items()
    }
    name = bytearray(identity.user_name.encode().ljust(TEXT_LENGTH, b"\0"))
    found[Abrm.USER_NAME] = block.add(Register(Abrm.USER_NAME, name, Access.RW))
    capability = _USER_NAME | _TIMESTAMP | _FAMILY | _MESSAGE_CHANNEL
    capability |= _HAS_SBRM | _ENDIANNESS | _WRITTEN_LENGTH
    for offset, number, length in (
        (Abrm.GENCP_VERSION, _GENCP_1_1, 4),
        (Abrm.CAPABILITY, capability, 8),
        (Abrm.MAX_RESPONSE_MS, MAX_RESPONSE_MS, 4),
        (Abrm.MANIFEST, MANIFEST, 8),
        (Abrm.SBRM, SBRM, 8),
        (Abrm.TIMESTAMP, 0, 8),
        (Abrm.TIMESTAMP_INCREMENT, 1, 8),
        (Abrm.ACCESS_PRIVILEGE, 0, 4),
        (Abrm.PROTOCOL_ENDIANNESS, 0xFFFF_FFFF, 4),
        (Abrm.IMPLEMENTATION_ENDIANNESS, 0xFFFF_FFFF, 4),
    ):
        found[offset] = _fixed(block, offset, number.to_bytes(length, "little"))
    for offset, length in (
        (Abrm.CONFIGURATION, 8),
        (Abrm.HEARTBEAT, 4),
        (Abrm.MESSAGE_CHANNEL, 4),
        (Abrm.TIMESTAMP_LATCH, 4),
    ):
        found[offset] = block.add(Register(offset, bytearray(length), Access.RW))
    return found


def _sbrm(space: AddressSpace) -> dict[int, Register]:
    block = space.add(SBRM, 0x1000)
    found: dict[int, Register] = {
        offset: _fixed(block, SBRM + offset, number.to_bytes(length, "little"))
        for offset, number, length in (
            (Sbrm.VERSION, _VISION_1_0, 4),
            (Sbrm.CAPABILITY, _STREAM_AND_EVENTS, 8),
            (Sbrm.MAX_COMMAND, MAX_COMMAND_BYTES, 4),
            (Sbrm.MAX_ACK, MAX_ACK_BYTES, 4),
            (Sbrm.STREAM_CHANNELS, 1, 4),
            (Sbrm.SIRM, SIRM, 8),
            (Sbrm.SIRM_LENGTH, 0x30, 4),
            (Sbrm.EIRM, EIRM, 8),
            (Sbrm.EIRM_LENGTH, 0x0C, 4),
            (Sbrm.IIDC2, 0, 8),
            (Sbrm.SPEED, Speed.SUPER.code, 4),
        )
    }
    address = SBRM + Sbrm.CONFIGURATION
    found[Sbrm.CONFIGURATION] = block.add(Register(address, bytearray(8), Access.RW))
    return found


def _sirm(space: AddressSpace) -> dict[int, Register]:
    block = space.add(SIRM, 0x1000)
    trailer = TRAILER.size + CHUNK_LAYOUT.size
    found: dict[int, Register] = {
        offset: _fixed(block, SIRM + offset, number.to_bytes(length, "little"))
        for offset, number, length in (
            (Sirm.INFO, ALIGNMENT_LOG2 << 24, 4),
            (Sirm.REQUIRED_PAYLOAD, 0, 8),
            (Sirm.REQUIRED_LEADER, LEADER.size, 4),
            (Sirm.REQUIRED_TRAILER, trailer, 4),
        )
    }
    for offset in set(Sirm) - set(found):
        found[offset] = block.add(Register(SIRM + offset, bytearray(4), Access.RW))
    found[Sirm.CONTROL].check = lambda data: _checked_sizes(found, data)
    return found


def _eirm(space: AddressSpace) -> dict[int, Register]:
    block = space.add(EIRM, 0x1000)
    longest = _fixed(block, EIRM + Eirm.MAX_EVENT, MAX_ACK_BYTES.to_bytes(4, "little"))
    found: dict[int, Register] = {Eirm.MAX_EVENT: longest}
    for offset in (Eirm.CONTROL, Eirm.TEST):
        found[offset] = block.add(Register(EIRM + offset, bytearray(4), Access.RW))
    return found


def _manifest(xml: bytes, kind: FileKind, space: AddressSpace) -> None:
    """One entry, and the file that it points to."""
    content = _zipped(xml) if kind is FileKind.ZIPPED else xml
    version, schema = 1 << 24, 1 << 24 | 1 << 16 | kind.value << 10
    entry = struct.pack("<QIIQQ", 1, version, schema, FILE, len(content))
    table = (entry + hashlib.sha1(content).digest()).ljust(8 + 64, b"\0")
    _fixed(space.add(MANIFEST, len(table)), MANIFEST, table)
    # Hosts read the last few bytes with their odd count or rounded up.
    padded = content.ljust(len(content) + -len(content) % 4, b"\0")
    _fixed(space.add(FILE, len(padded), alignment=1), FILE, padded)


def _zipped(xml: bytes) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("emulated.xml"), xml, zipfile.ZIP_DEFLATED)
    return target.getvalue()


def _fixed(block: Block, address: int, data: bytes) -> Register:
    return block.add(Register(address, bytearray(data)))
