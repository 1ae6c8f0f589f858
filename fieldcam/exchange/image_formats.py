"""Looks at an image file's own structure before a lenient decoder sees it.

OpenCV's decoders answer a truncated file with a half-grey picture and a warning
on stderr; sizes read from such a picture would look right. So the end of every
file is checked here first.
"""

from __future__ import annotations

import re
import struct
import zlib
from dataclasses import dataclass

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
JPEG_SIGNATURE = b"\xff\xd8"
PNM_CHANNELS = {b"P5": 1, b"P6": 3}

PNM_HEADER = re.compile(
    rb"(P[56])(?:\s+|#[^\n]*\n)+(\d{1,6})(?:\s+|#[^\n]*\n)+(\d{1,6})"
    rb"(?:\s+|#[^\n]*\n)+(\d{1,6})\s"
)

TRUNCATED = "is truncated"
DAMAGED = "is damaged"


@dataclass(frozen=True, slots=True)
class ImageHeader:
    """What a complete image file says about itself."""

    width_px: int
    height_px: int
    bits: int
    """Per channel."""
    channels: int = 0
    """Only where the pixels lie in the file as they are."""
    pixels_at: int = 0
    """Offset of the first pixel in such a file."""


class BrokenImage(Exception):
    """Its text goes on after the file's name, as in `is truncated`."""


def image_header(data: bytes) -> ImageHeader | None:
    """The header of a complete PNG, JPEG, PGM or PPM file; None for other files."""
    if data.startswith(PNG_SIGNATURE):
        return _png_header(data)
    if data.startswith(JPEG_SIGNATURE):
        return _jpeg_header(data)
    if data[:2] in PNM_CHANNELS:
        return _pnm_header(data)
    return None


def _png_header(data: bytes) -> ImageHeader:
    """Walks all chunks, with their checksums, up to the end mark."""
    header = None
    position = len(PNG_SIGNATURE)
    while position + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, position)
        end = position + 12 + length
        if end > len(data):
            break
        (checksum,) = struct.unpack_from(">I", data, end - 4)
        if zlib.crc32(memoryview(data)[position + 4 : end - 4]) != checksum:
            raise BrokenImage(DAMAGED)
        kind = data[position + 4 : position + 8]
        if header is None:
            if kind != b"IHDR" or length != 13:
                raise BrokenImage(DAMAGED)
            header = ImageHeader(*struct.unpack_from(">IIB", data, position + 8))
        if kind == b"IEND":
            return header
        position = end
    raise BrokenImage(TRUNCATED)


def _jpeg_header(data: bytes) -> ImageHeader:
    """Walks all segments and scans up to the end mark.

    Looking for the end mark's bytes alone would find that of a thumbnail.
    """
    header = None
    position = 2
    while True:
        position, marker = _next_marker(data, position)
        if marker == 0xD9:
            if header is None:
                raise BrokenImage(DAMAGED)
            return header
        if position + 2 > len(data):
            raise BrokenImage(TRUNCATED)
        (length,) = struct.unpack_from(">H", data, position)
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            if length < 8 or position + 7 > len(data):
                raise BrokenImage(DAMAGED)
            bits, height, width = struct.unpack_from(">BHH", data, position + 2)
            header = ImageHeader(width, height, bits)
        position += length


def _next_marker(data: bytes, position: int) -> tuple[int, int]:
    """Offset behind the next marker and its code, past any compressed data.

    In compressed data 0xFF is followed by 0x00 or a restart code.
    """
    while True:
        position = data.find(b"\xff", position)
        if position < 0 or position + 1 >= len(data):
            raise BrokenImage(TRUNCATED)
        code = data[position + 1]
        if code == 0xFF:
            position += 1
        elif code == 0x00 or 0xD0 <= code <= 0xD7:
            position += 2
        else:
            return position + 2, code


def _pnm_header(data: bytes) -> ImageHeader:
    match = PNM_HEADER.match(data)
    if match is None:
        raise BrokenImage(DAMAGED)
    width, height, largest = (int(number) for number in match.groups()[1:])
    if largest < 255:
        raise BrokenImage(f"uses only grey levels up to {largest}, not 255")
    channels = PNM_CHANNELS[match[1]]
    header = ImageHeader(width, height, 8 if largest == 255 else 16, channels, match.end())
    if len(data) - match.end() < width * height * channels:
        raise BrokenImage(TRUNCATED)
    return header
