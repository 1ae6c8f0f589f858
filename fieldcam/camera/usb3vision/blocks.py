"""Leaders and trailers: what a camera sends before and after each block of image data. Pure.

Little-endian. The layout is that which the aravis, NI and Wireshark sources agree on.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

LEADER_PREFIX = 0x4C563355
"""The bytes `U3VL`."""
TRAILER_PREFIX = 0x54563355
"""The bytes `U3VT`."""

_LEADER = struct.Struct("<IHHQHHQ")
_IMAGE = struct.Struct("<IIIIIHH")
_TRAILER = struct.Struct("<IHHQHHQ")
_HEIGHT = struct.Struct("<I")

LEADER_BYTES = _LEADER.size + _IMAGE.size
"""Of an image's leader."""
TRAILER_BYTES = _TRAILER.size + _HEIGHT.size
"""Of an image's trailer."""
_LONGEST_TRAILER_BYTES = 64


class PayloadType(IntEnum):
    """What a block holds."""

    IMAGE = 0x0001
    CHUNKS = 0x4000
    IMAGE_WITH_CHUNKS = 0x4001


@dataclass(frozen=True, slots=True)
class ImageInfo:
    """The image that a block holds."""

    pixel_format: int
    """A PFNC value."""
    width_px: int
    height_px: int
    offset_x_px: int
    offset_y_px: int
    padding_x_bytes: int
    """Behind each row."""

    @property
    def row_bits(self) -> int:
        """Of one row's pixels; bits 16 to 23 of a PFNC value are those of a pixel."""
        return self.width_px * (self.pixel_format >> 16 & 0xFF)

    @property
    def size_bytes(self) -> int:
        """Of the whole image. Packed pixels run on from row to row where nothing pads them."""
        if self.padding_x_bytes:
            return self.height_px * (-(-self.row_bits // 8) + self.padding_x_bytes)
        return -(-self.height_px * self.row_bits // 8)


@dataclass(frozen=True, slots=True)
class Leader:
    """What comes before a block's data."""

    block_id: int
    payload_type: int
    """A PayloadType, or another one."""
    timestamp_ns: int
    """The camera's own clock."""
    image: ImageInfo | None
    """None where the block holds no plain image."""


@dataclass(frozen=True, slots=True)
class Trailer:
    """What comes after a block's data."""

    block_id: int
    status: int
    valid_bytes: int
    """How much of the data the camera vouches for."""
    height_px: int | None
    """Rows really sent; None where the block holds no image."""


def parse_leader(transfer: bytes) -> Leader | None:
    """The leader that one transfer holds; None for any other transfer."""
    if len(transfer) < _LEADER.size:
        return None
    prefix, _, size, block_id, _, payload_type, timestamp_ns = _LEADER.unpack_from(transfer)
    if prefix != LEADER_PREFIX or not _LEADER.size <= size <= len(transfer):
        return None
    image = None
    if payload_type in (PayloadType.IMAGE, PayloadType.IMAGE_WITH_CHUNKS):
        if size < LEADER_BYTES:
            return None
        image = ImageInfo(*_IMAGE.unpack_from(transfer, _LEADER.size)[:-1])
    return Leader(block_id, payload_type, timestamp_ns, image)


def parse_trailer(transfer: bytes) -> Trailer | None:
    """The trailer that one transfer holds; None for any other transfer."""
    if len(transfer) < _TRAILER.size:
        return None
    prefix, _, size, block_id, status, _, valid_bytes = _TRAILER.unpack_from(transfer)
    if prefix != TRAILER_PREFIX or not _TRAILER.size <= size <= len(transfer):
        return None
    height_px = None
    if size >= TRAILER_BYTES:
        (height_px,) = _HEIGHT.unpack_from(transfer, _TRAILER.size)
    return Trailer(block_id, status, valid_bytes, height_px)


def trailer_at_end(tail: bytes) -> tuple[Trailer, int] | None:
    """A trailer with which these bytes end, and how many of them come before it.

    Where the data fill their last packet, nothing on the bus parts them from the
    trailer, and one read gets both.
    """
    start = tail.rfind(TRAILER_PREFIX.to_bytes(4, "little"), -_LONGEST_TRAILER_BYTES)
    trailer = None if start < 0 else parse_trailer(tail[start:])
    return None if trailer is None else (trailer, start)
