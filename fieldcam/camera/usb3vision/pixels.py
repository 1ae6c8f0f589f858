"""Pixel formats (PFNC) to what RawPair holds: 8 bits, one channel or RGB. Pure numpy.

Deeper pixels keep their 8 highest bits. Colours stay in their Bayer mosaic, as the
sensor gave them; the analysis interpolates them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldcam.camera.usb3vision.blocks import ImageInfo
from fieldcam.camera.usb3vision.frames import UsbFrame
from fieldcam.camera.usb3vision.transport import Bytes
from fieldcam.errors import CameraUnsupported
from fieldcam.values import ImageU8, PixelFormat

Rows = Bytes
"""(H, n) uint8: the bytes of each row, without its padding."""


@dataclass(frozen=True, slots=True)
class Coding:
    """How a PFNC format stores its pixels."""

    pixel_format: PixelFormat
    to_8_bits: Callable[[Rows], Bytes]
    """From (H, n) uint8 bytes to (H, W) or (H, W * 3) uint8 pixels."""


def decode(frame: UsbFrame) -> tuple[ImageU8, PixelFormat]:
    """The frame's image: (H, W, 3) for RGB8, else (H, W).

    A view of the frame's memory where the camera sends 8 bits. Raises CameraUnsupported
    for a block without an image and for formats that fieldcam does not know.
    """
    info = frame.image
    if info is None:
        raise CameraUnsupported(
            f"The camera sends blocks of type 0x{frame.payload_type:04X}, not plain images."
        )
    coding = CODINGS.get(info.pixel_format)
    if coding is None:
        raise CameraUnsupported(
            f"The camera's pixel format 0x{info.pixel_format:08X} is unknown.",
            "Set PixelFormat to one of the 8-bit Bayer formats.",
        )
    pixels = coding.to_8_bits(_rows(frame.payload, info))
    if coding.pixel_format is PixelFormat.RGB8:
        pixels = pixels.reshape(info.height_px, info.width_px, 3)
    return pixels, coding.pixel_format


def _rows(payload: Bytes, info: ImageInfo) -> Rows:
    if not info.size_bytes or info.row_bits % 8:
        raise CameraUnsupported(
            f"The camera sends pictures of {info.width_px} x {info.height_px} pixels, "
            "whose rows do not end with a byte.",
            "Set Width to a multiple of 8.",
        )
    row_bytes = info.row_bits // 8
    rows = payload[: info.size_bytes].reshape(info.height_px, -1)
    return rows[:, :row_bytes]


def _as_they_are(rows: Rows) -> Bytes:
    return rows


def _reversed_channels(rows: Rows) -> Bytes:
    """BGR to RGB."""
    return rows.reshape(len(rows), -1, 3)[..., ::-1]


def _unpacked(bits: int) -> Callable[[Rows], Bytes]:
    """Two bytes for each pixel, the lower one first."""

    def high_bits(rows: Rows) -> Bytes:
        words = np.ascontiguousarray(rows).view("<u2")
        return (words >> (bits - 8)).astype(np.uint8)

    return high_bits


def _packed_10(rows: Rows) -> Bytes:
    """Four pixels in five bytes, lowest bits first."""
    b0, b1, b2, b3, b4 = _groups(rows, 5)
    return _interleaved(
        b0 >> 2 | b1 << 6,
        b1 >> 4 | b2 << 4,
        b2 >> 6 | b3 << 2,
        b4,
    )


def _packed_12(rows: Rows) -> Bytes:
    """Two pixels in three bytes, lowest bits first."""
    b0, b1, b2 = _groups(rows, 3)
    return _interleaved(b0 >> 4 | b1 << 4, b2)


def _high_bytes_outside(rows: Rows) -> Bytes:
    """Two pixels in three bytes: the high bits of both, their low bits between."""
    b0, _, b2 = _groups(rows, 3)
    return _interleaved(b0, b2)


def _groups(rows: Rows, length: int) -> list[Bytes]:
    """The first bytes of all groups, the second ones ...: each (H, groups) uint8."""
    return [rows[:, place::length] for place in range(length)]


def _interleaved(*pixels: npt.NDArray[np.integer[Any]]) -> Bytes:
    """(H, groups) uint8 of each place in a group to (H, W)."""
    joined = np.stack(pixels, axis=-1).reshape(len(pixels[0]), -1)
    return joined.astype(np.uint8, copy=False)


_BAYER = (
    PixelFormat.BAYER_GR8,
    PixelFormat.BAYER_RG8,
    PixelFormat.BAYER_GB8,
    PixelFormat.BAYER_BG8,
)


def _family(
    mono: int, bayer: tuple[int, int, int, int], to_8_bits: Callable[[Rows], Bytes]
) -> dict[int, Coding]:
    """Mono and the four mosaics GR, RG, GB, BG of one coding."""
    mosaics = dict(zip(bayer, _BAYER, strict=True))
    return {
        value: Coding(pixel_format, to_8_bits)
        for value, pixel_format in {mono: PixelFormat.MONO8, **mosaics}.items()
    }


CODINGS: dict[int, Coding] = {
    **_family(0x01080001, (0x01080008, 0x01080009, 0x0108000A, 0x0108000B), _as_they_are),
    **_family(0x01100003, (0x0110000C, 0x0110000D, 0x0110000E, 0x0110000F), _unpacked(10)),
    **_family(0x01100005, (0x01100010, 0x01100011, 0x01100012, 0x01100013), _unpacked(12)),
    **_family(0x01100007, (0x0110002E, 0x0110002F, 0x01100030, 0x01100031), _unpacked(16)),
    **_family(0x010A0046, (0x010A0056, 0x010A0058, 0x010A0054, 0x010A0052), _packed_10),
    **_family(0x010C0047, (0x010C0057, 0x010C0059, 0x010C0055, 0x010C0053), _packed_12),
    **_family(0x010C0004, (0x010C0026, 0x010C0027, 0x010C0028, 0x010C0029), _high_bytes_outside),
    **_family(0x010C0006, (0x010C002A, 0x010C002B, 0x010C002C, 0x010C002D), _high_bytes_outside),
    0x02180014: Coding(PixelFormat.RGB8, _as_they_are),
    0x02180015: Coding(PixelFormat.RGB8, _reversed_channels),
}
"""By PFNC value."""
