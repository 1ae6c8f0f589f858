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

from fieldcam.foreign.bounds import LONGEST_PNM_HEADER_BYTES, MAX_IMAGE_PARTS, MAX_JPEG_SCANS

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
JPEG_SIGNATURE = b"\xff\xd8"
RAW_SUFFIXES = (".pgm", ".ppm")
"""Of files that hold their pixels as a camera gave them."""
PNM_CHANNELS = {b"P5": 1, b"P6": 3}

_GAP = rb"(?:\s|#[^\n]*\n)+"
PNM_HEADER = re.compile(
    rb"(P[56])" + _GAP + rb"(\d{1,6})" + _GAP + rb"(\d{1,6})" + _GAP + rb"(\d{1,6})\s"
)
JPEG_MARKER = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
"""In compressed data 0xFF is followed by 0x00 or a restart code; it may be repeated."""
END_OF_IMAGE, START_OF_SCAN = 0xD9, 0xDA

TRUNCATED = "is truncated"
DAMAGED = "is damaged"
TOO_MANY_PARTS = "has more parts than a picture needs"


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
    for _ in range(MAX_IMAGE_PARTS):
        if position + 12 > len(data):
            raise BrokenImage(TRUNCATED)
        (length,) = struct.unpack_from(">I", data, position)
        end = position + 12 + length
        if end > len(data):
            raise BrokenImage(TRUNCATED)
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
    raise BrokenImage(TOO_MANY_PARTS)


def _jpeg_header(data: bytes) -> ImageHeader:
    """Walks all segments and scans up to the end mark.

    Looking for the end mark's bytes alone would find that of a thumbnail.
    """
    header = None
    position, scans = 2, 0
    for _ in range(MAX_IMAGE_PARTS):
        position, marker = _next_marker(data, position)
        if marker == END_OF_IMAGE:
            if header is None:
                raise BrokenImage(DAMAGED)
            return header
        scans += marker == START_OF_SCAN
        if scans > MAX_JPEG_SCANS:
            break
        if position + 2 > len(data):
            raise BrokenImage(TRUNCATED)
        (length,) = struct.unpack_from(">H", data, position)
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            if length < 8 or position + 7 > len(data):
                raise BrokenImage(DAMAGED)
            bits, height, width = struct.unpack_from(">BHH", data, position + 2)
            header = ImageHeader(width, height, bits)
        position += length
    raise BrokenImage(TOO_MANY_PARTS)


def _next_marker(data: bytes, position: int) -> tuple[int, int]:
    """Offset behind the next marker and its code, past any compressed data."""
    found = JPEG_MARKER.search(data, position)
    if found is None:
        raise BrokenImage(TRUNCATED)
    return found.end(), data[found.end() - 1]


def _pnm_header(data: bytes) -> ImageHeader:
    match = PNM_HEADER.match(data[:LONGEST_PNM_HEADER_BYTES])
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
