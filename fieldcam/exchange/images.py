"""Reads and writes image files."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from fieldcam.disk.image_headers import ImageHeader
from fieldcam.disk.targets import check_target, write_target
from fieldcam.errors import ImageUnreadable
from fieldcam.exchange.image_files import ImageFile, check_same_size, checked_image, read_image_file
from fieldcam.images.pixels import check_size
from fieldcam.values import Calibration, ImageU8


def read_image(path: Path) -> ImageU8:
    """RGB (H, W, 3) from an 8-bit PNG, JPEG, PGM or PPM file.

    Grey becomes three equal channels, transparency is dropped, and a turn noted
    in the file's metadata is not applied: a calibration holds for the sensor.
    """
    return _pixels(read_image_file(path))


def decode_image(content: bytes, name: str) -> ImageU8:
    """The same (H, W, 3), of what was read already; `name` is for the error's sentence."""
    return _pixels(checked_image(content, name))


def read_pair(left_path: Path, right_path: Path) -> tuple[ImageU8, ImageU8]:
    """Both eyes' images (H, W, 3), checked to have the same size."""
    left, right = read_image_file(left_path), read_image_file(right_path)
    check_same_size(left, right)
    return _pixels(left), _pixels(right)


def check_against(calibration: Calibration, image: ImageU8) -> None:
    """Refuses an image (H, W, 3) whose size is not the calibration's."""
    check_size((image.shape[1], image.shape[0]), calibration.size_px)


def check_png_target(path: Path) -> None:
    """Raise BadInput where `write_png` could not write; found out before the work, not after."""
    check_target(path, ".png", "the picture is written as PNG")


def write_png(path: Path, image: ImageU8) -> None:
    """Writes RGB (H, W, 3) or grey (H, W)."""
    write_target(path, encode_png(image))


def encode_png(image: ImageU8) -> bytes:
    """A file of RGB (H, W, 3) or grey (H, W)."""
    stored = image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1])
    _done, encoded = cv2.imencode(".png", stored)
    return encoded.tobytes()


def _pixels(file: ImageFile) -> ImageU8:
    """(H, W, 3)."""
    header = file.header
    image = _stored_pixels(file.content, header) if header.pixels_at else _decode(file)
    if image.shape != (header.height_px, header.width_px, 3):
        raise _damaged(file)
    return image


def _stored_pixels(data: bytes, header: ImageHeader) -> ImageU8:
    """Of a file that holds its pixels as they are."""
    shape = header.height_px, header.width_px, header.channels
    count = header.height_px * header.width_px * header.channels
    pixels = np.frombuffer(data, np.uint8, count, header.pixels_at).reshape(shape)
    return np.repeat(pixels, 3, axis=2) if header.channels == 1 else pixels.copy()


def _decode(file: ImageFile) -> ImageU8:
    flags = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        decoded = cv2.imdecode(np.frombuffer(file.content, np.uint8), flags)
    except cv2.error as error:
        raise _damaged(file) from error
    if decoded is None:
        raise _damaged(file)
    return np.asarray(decoded, np.uint8)


def _damaged(file: ImageFile) -> ImageUnreadable:
    return ImageUnreadable(f"{file.name} is damaged.", "Copy it again.")
