"""Raw images as binary PGM (one channel) and PPM (RGB): the sensor's bytes and a short header."""

from __future__ import annotations

import numpy as np

from fieldcam.disk.image_headers import RAW_SUFFIXES, BrokenImage, image_header
from fieldcam.errors import ImageUnreadable
from fieldcam.values import ImageU8


def raw_suffix(image: ImageU8) -> str:
    """File name ending for this image: `.pgm` for (H, W), `.ppm` for (H, W, 3)."""
    return RAW_SUFFIXES[image.ndim == 3]


def encode_raw(image: ImageU8) -> bytes:
    """A uint8 image (H, W) or (H, W, 3) as a PGM or PPM file."""
    magic = b"P5" if image.ndim == 2 else b"P6"
    height, width = image.shape[:2]
    return b"%s\n%d %d\n255\n" % (magic, width, height) + np.ascontiguousarray(image).tobytes()


def decode_raw(content: bytes, name: str) -> ImageU8:
    """The image of a PGM or PPM file, channels as stored; `name` is for the error's sentence."""
    try:
        header = image_header(content)
    except BrokenImage as error:
        raise ImageUnreadable(f"{name} {error}.") from error
    if header is None or not header.pixels_at or header.bits != 8:
        raise ImageUnreadable(f"{name} is not an 8-bit binary PGM or PPM file.")
    shape = (header.height_px, header.width_px, header.channels)
    count = header.height_px * header.width_px * header.channels
    pixels = np.frombuffer(content, np.uint8, count, header.pixels_at).reshape(shape)
    return pixels[..., 0] if header.channels == 1 else pixels
