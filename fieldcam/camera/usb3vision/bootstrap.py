"""The registers that every USB3 Vision camera has, read through the channel. Pure values.

ABRM: what the camera is. SBRM: what its USB3 Vision part can do. SIRM: what its stream
needs. EIRM: its event channel. Addresses beyond the ABRM are pointers, which differ
between makers. Offsets as in the aravis and NI sources.
"""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass

from fieldcam.camera.genapi.registers import Registers
from fieldcam.camera.usb3vision.channel import ChannelLimits
from fieldcam.camera.usb3vision.gencp import HEADER_BYTES, WRITE_OVERHEAD_BYTES
from fieldcam.camera.usb3vision.transport import LinkSpeed
from fieldcam.errors import CameraRefused, CameraUnsupported

_TEXT_BYTES = 64
_TIMESTAMP = 0x1F0
_TIMESTAMP_LATCH = 0x1F8
_HAS_SIRM = 1 << 0
_HAS_EIRM = 1 << 1
_SHORTEST_RESPONSE_S = 1.0
"""Some cameras answer later than they say."""
_LONGEST_PACKET_BYTES = 1 << 16
_LARGEST_ALIGNMENT_LOG2 = 16


@dataclass(frozen=True, slots=True)
class Abrm:
    """Technology-agnostic bootstrap registers."""

    gencp_version: tuple[int, int]
    manufacturer: str
    model: str
    family: str
    device_version: str
    manufacturer_info: str
    serial: str
    user_name: str
    response_s: float
    """The longest time that the camera says it takes to answer."""
    manifest_address: int
    sbrm_address: int


@dataclass(frozen=True, slots=True)
class Sbrm:
    """Technology-specific bootstrap registers; addresses are None where a part is absent."""

    u3v_version: tuple[int, int]
    command_bytes: int
    ack_bytes: int
    stream_channels: int
    sirm_address: int | None
    eirm_address: int | None
    speed: LinkSpeed


@dataclass(frozen=True, slots=True)
class Sirm:
    """What the stream needs with the features as they are now set."""

    address: int
    alignment_bytes: int
    payload_bytes: int
    leader_bytes: int
    trailer_bytes: int


@dataclass(frozen=True, slots=True)
class Eirm:
    """The event channel."""

    address: int
    event_bytes: int
    """Of the longest event."""


@dataclass(frozen=True, slots=True)
class ClockSample:
    """The camera's clock and the host's monotonic one at the same moment."""

    device_ns: int
    host_ns: int
    uncertainty_ns: int
    """Half the time that the question took."""


def read_abrm(registers: Registers) -> Abrm:
    """Raises CameraRefused where a register is missing that no camera may leave out."""
    return Abrm(
        _version(registers, 0x000),
        _text(registers, 0x004),
        _text(registers, 0x044),
        _text(registers, 0x084),
        _text(registers, 0x0C4),
        _text(registers, 0x104),
        _text(registers, 0x144),
        _text(registers, 0x184),
        read_u32(registers, 0x1CC) / 1000,
        read_u64(registers, 0x1D0),
        read_u64(registers, 0x1D8),
    )


def read_sbrm(registers: Registers, abrm: Abrm) -> Sbrm:
    """Raises as `read_abrm` does."""
    base = abrm.sbrm_address
    capability = read_u64(registers, base + 0x04)
    return Sbrm(
        _version(registers, base),
        read_u32(registers, base + 0x14),
        read_u32(registers, base + 0x18),
        read_u32(registers, base + 0x1C),
        read_u64(registers, base + 0x20) if capability & _HAS_SIRM else None,
        read_u64(registers, base + 0x2C) if capability & _HAS_EIRM else None,
        _speed(registers, base + 0x40),
    )


def channel_limits(abrm: Abrm, sbrm: Sbrm) -> ChannelLimits:
    """What the camera takes, as it says; nonsense is refused."""
    shortest = (WRITE_OVERHEAD_BYTES + 4, HEADER_BYTES + 4)
    for length, least in zip((sbrm.command_bytes, sbrm.ack_bytes), shortest, strict=True):
        if length < least:
            raise CameraUnsupported(f"The camera says that its packets hold {length} bytes.")
    return ChannelLimits(
        min(sbrm.command_bytes, _LONGEST_PACKET_BYTES),
        min(sbrm.ack_bytes, _LONGEST_PACKET_BYTES),
        max(abrm.response_s, _SHORTEST_RESPONSE_S),
    )


def read_sirm(registers: Registers, sbrm: Sbrm) -> Sirm:
    """Read anew whenever a feature that changes the image's size was set."""
    if not sbrm.sirm_address:
        raise CameraUnsupported("The camera has no image stream.")
    base = sbrm.sirm_address
    alignment_log2 = read_u32(registers, base) >> 24
    if alignment_log2 > _LARGEST_ALIGNMENT_LOG2:
        raise CameraUnsupported(f"The camera aligns its transfers to 2^{alignment_log2} bytes.")
    return Sirm(
        base,
        1 << alignment_log2,
        read_u64(registers, base + 0x08),
        read_u32(registers, base + 0x10),
        read_u32(registers, base + 0x14),
    )


def read_eirm(registers: Registers, sbrm: Sbrm) -> Eirm | None:
    """None where the camera has no event channel."""
    if not sbrm.eirm_address:
        return None
    return Eirm(sbrm.eirm_address, read_u32(registers, sbrm.eirm_address + 0x04))


def latch_clock(registers: Registers) -> ClockSample:
    """Both clocks at one moment; raises CameraRefused where the camera cannot latch its own."""
    before_ns = time.monotonic_ns()
    write_u32(registers, _TIMESTAMP_LATCH, 1)
    after_ns = time.monotonic_ns()
    device_ns = read_u64(registers, _TIMESTAMP)
    return ClockSample(device_ns, (before_ns + after_ns) // 2, (after_ns - before_ns) // 2)


def read_u32(registers: Registers, address: int) -> int:
    """Little-endian, as all registers of the bootstrap."""
    return int.from_bytes(registers.read(address, 4), "little")


def read_u64(registers: Registers, address: int) -> int:
    """As `read_u32`."""
    return int.from_bytes(registers.read(address, 8), "little")


def write_u32(registers: Registers, address: int, value: int) -> None:
    """As `read_u32`."""
    registers.write(address, struct.pack("<I", value))


def _version(registers: Registers, address: int) -> tuple[int, int]:
    """Major, minor."""
    version = read_u32(registers, address)
    return version >> 16, version & 0xFFFF


def _text(registers: Registers, address: int) -> str:
    """Empty where the camera leaves this register out."""
    try:
        content = registers.read(address, _TEXT_BYTES)
    except CameraRefused:
        return ""
    return content.split(b"\0", 1)[0].decode("utf-8", "replace").strip()


def _speed(registers: Registers, address: int) -> LinkSpeed:
    """UNKNOWN where the camera leaves this register out, or sets no single known bit."""
    try:
        bits = read_u32(registers, address)
    except CameraRefused:
        return LinkSpeed.UNKNOWN
    # Bit 0 is low speed.
    speed = bits.bit_length()
    plain = bits and bits & (bits - 1) == 0 and speed <= LinkSpeed.SUPER_PLUS
    return LinkSpeed(speed) if plain else LinkSpeed.UNKNOWN
