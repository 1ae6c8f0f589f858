"""Image files as they lie on the disk: complete, 8-bit and of one size, but not decoded.

Finding this out loads no image library.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fieldcam.disk.image_headers import (
    JPEG_SIGNATURE,
    PNG_SIGNATURE,
    BrokenImage,
    ImageHeader,
    image_header,
)
from fieldcam.errors import ImageUnreadable, PairMismatch
from fieldcam.foreign.bounds import IMAGE, MAX_PIXELS
from fieldcam.foreign.files import read_foreign


@dataclass(frozen=True, slots=True)
class ImageFile:
    """One file whose structure was checked up to its end."""

    name: str
    """For sentences about it."""
    content: bytes
    header: ImageHeader

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.header.width_px, self.header.height_px

    @property
    def suffix(self) -> str:
        """The ending that fits its content, whatever it was called."""
        if self.content.startswith(PNG_SIGNATURE):
            return ".png"
        if self.content.startswith(JPEG_SIGNATURE):
            return ".jpg"
        return ".pgm" if self.header.channels == 1 else ".ppm"


def read_image_file(path: Path) -> ImageFile:
    """A PNG, JPEG, PGM or PPM file."""
    return checked_image(_read_bytes(path), str(path))


def checked_image(content: bytes, name: str) -> ImageFile:
    """The same, of what was read already."""
    try:
        header = image_header(content)
    except BrokenImage as error:
        raise ImageUnreadable(f"{name} {error}.", "Copy it again.") from error
    if header is None:
        raise ImageUnreadable(f"{name} is no PNG, JPEG, PGM or PPM image.")
    _check_header(name, header)
    return ImageFile(name, content, header)


def check_same_size(left: ImageFile, right: ImageFile) -> None:
    """Refuses two images that cannot be of one exposure."""
    if left.size_px != right.size_px:
        raise PairMismatch(
            f"{left.name} has {_text(left.size_px)}, {right.name} {_text(right.size_px)}.",
            "Give the two images of one exposure.",
        )


def _read_bytes(path: Path) -> bytes:
    data = read_foreign(path, IMAGE)
    if not data:
        raise ImageUnreadable(f"{path} is empty.")
    return data


def _check_header(name: str, header: ImageHeader) -> None:
    if header.bits > 8:
        raise ImageUnreadable(
            f"{name} has {header.bits} bits per channel.", "Convert it to 8 bits."
        )
    pixels = header.width_px * header.height_px
    if pixels > MAX_PIXELS:
        raise ImageUnreadable(
            f"{name} has {header.width_px} x {header.height_px} pixels: a picture may have"
            f" {MAX_PIXELS // 10**6} million.",
            "Make it smaller, or take it with fewer pixels.",
        )
    if pixels == 0:
        raise ImageUnreadable(f"{name} is {header.width_px} x {header.height_px} pixels large.")


def _text(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} x {size_px[1]} pixels"
