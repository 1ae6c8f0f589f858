"""Reads and writes image files."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from fieldcam.errors import BadInput, ImageUnreadable, PairMismatch
from fieldcam.exchange.image_formats import BrokenImage, ImageHeader, image_header
from fieldcam.values import Calibration, ImageU8

LARGEST_PIXELS = 100_000_000


def read_image(path: Path) -> ImageU8:
    """RGB (H, W, 3) from an 8-bit PNG, JPEG, PGM or PPM file.

    Grey becomes three equal channels, transparency is dropped, and a turn noted
    in the file's metadata is not applied: a calibration holds for the sensor.
    """
    data = _read_bytes(path)
    try:
        header = image_header(data)
    except BrokenImage as error:
        raise ImageUnreadable(f"{path} {error}.", "Copy it again.") from error
    if header is None:
        raise ImageUnreadable(f"{path} is no PNG, JPEG, PGM or PPM image.")
    _check_header(path, header)
    image = _stored_pixels(data, header) if header.pixels_at else _decode(path, data)
    if image.shape != (header.height_px, header.width_px, 3):
        raise ImageUnreadable(f"{path} is damaged.", "Copy it again.")
    return image


def read_pair(left_path: Path, right_path: Path) -> tuple[ImageU8, ImageU8]:
    """Both eyes' images, checked to have the same size."""
    left, right = read_image(left_path), read_image(right_path)
    if left.shape != right.shape:
        raise PairMismatch(
            f"{left_path} has {_size_text(left)}, {right_path} {_size_text(right)}.",
            "Give the two images of one exposure.",
        )
    return left, right


def check_against(calibration: Calibration, image: ImageU8) -> None:
    """Refuses an image whose size is not the calibration's."""
    if image.shape[:2] == (calibration.height_px, calibration.width_px):
        return
    raise PairMismatch(
        f"The image has {_size_text(image)}, its calibration"
        f" {calibration.width_px} x {calibration.height_px}.",
        "Give the calibration of the camera that took it.",
    )


def check_png_target(path: Path) -> None:
    """Raise BadInput where `write_png` could not write; found out before the work, not after."""
    if path.suffix.lower() != ".png":
        raise BadInput(f"{path} must end in .png: the picture is written as PNG.")
    if path.is_dir():
        raise BadInput(f"{path} is a folder.")
    if not path.parent.is_dir():
        raise BadInput(f"There is no folder {path.parent} to write {path.name} into.")


def write_png(path: Path, image: ImageU8) -> None:
    """Writes RGB (H, W, 3) or grey (H, W)."""
    stored = image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1])
    _done, encoded = cv2.imencode(".png", stored)
    try:
        path.write_bytes(encoded.tobytes())
    except OSError as error:
        raise BadInput(f"{path} cannot be written: {error.strerror}.") from error


def _read_bytes(path: Path) -> bytes:
    if path.is_dir():
        raise ImageUnreadable(f"{path} is a folder, not an image.")
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise ImageUnreadable(f"There is no image {path}.") from error
    except OSError as error:
        raise ImageUnreadable(f"{path} cannot be read: {error.strerror}.") from error
    if not data:
        raise ImageUnreadable(f"{path} is empty.")
    return data


def _check_header(path: Path, header: ImageHeader) -> None:
    if header.bits > 8:
        raise ImageUnreadable(
            f"{path} has {header.bits} bits per channel.", "Convert it to 8 bits."
        )
    pixels = header.width_px * header.height_px
    if not 0 < pixels <= LARGEST_PIXELS:
        raise ImageUnreadable(
            f"{path} gives an impossible size of {header.width_px} x {header.height_px} pixels."
        )


def _stored_pixels(data: bytes, header: ImageHeader) -> ImageU8:
    """(H, W, 3) of a file that holds its pixels as they are."""
    shape = header.height_px, header.width_px, header.channels
    count = header.height_px * header.width_px * header.channels
    pixels = np.frombuffer(data, np.uint8, count, header.pixels_at).reshape(shape)
    return np.repeat(pixels, 3, axis=2) if header.channels == 1 else pixels.copy()


def _decode(path: Path, data: bytes) -> ImageU8:
    flags = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        decoded = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error as error:
        raise ImageUnreadable(f"{path} is damaged.", "Copy it again.") from error
    if decoded is None:
        raise ImageUnreadable(f"{path} is damaged.", "Copy it again.")
    return np.asarray(decoded, np.uint8)


def _size_text(image: ImageU8) -> str:
    return f"{image.shape[1]} x {image.shape[0]} pixels"
