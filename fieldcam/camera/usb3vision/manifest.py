"""The manifest: where in the camera's memory its description files lie."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from fieldcam.camera.genapi.registers import Registers
from fieldcam.camera.usb3vision.bootstrap import Abrm, read_u64
from fieldcam.errors import CameraUnsupported

MAX_ENTRIES = 64
"""Real cameras have one to three."""

_ENTRY = struct.Struct("<HBB I Q Q 20s 20x")
_FORMAT_SHIFT, _FORMAT_MASK = 10, 0x3F
_CONTENT_MASK = 0x7
_DEVICE_CONTENT = 0
"""A description of the device, not of its buffers."""


class FileFormat(IntEnum):
    """How a description file is stored."""

    XML = 0
    ZIP = 1


@dataclass(frozen=True, slots=True)
class ManifestEntry:
    """One description file."""

    file_version: tuple[int, int, int]
    """Major, minor, subminor."""
    schema_version: tuple[int, int]
    file_format: int
    """A FileFormat, or a later one; what the file really is, its content tells."""
    describes_device: bool
    address: int
    length: int
    sha1: bytes | None
    """20 bytes; None where the camera gives none."""


def parse_entry(content: bytes) -> ManifestEntry:
    """One entry of 64 bytes."""
    subminor, minor, major, schema, address, length, sha1 = _ENTRY.unpack(content)
    return ManifestEntry(
        (major, minor, subminor),
        (schema >> 24, schema >> 16 & 0xFF),
        schema >> _FORMAT_SHIFT & _FORMAT_MASK,
        schema & _CONTENT_MASK == _DEVICE_CONTENT,
        address,
        length,
        sha1 if any(sha1) else None,
    )


def read_manifest(registers: Registers, abrm: Abrm) -> tuple[ManifestEntry, ...]:
    """All description files of the camera, at least one."""
    count = read_u64(registers, abrm.manifest_address)
    if not 1 <= count <= MAX_ENTRIES:
        raise CameraUnsupported(f"The camera says that it has {count} description files.")
    first = abrm.manifest_address + 8
    return tuple(
        parse_entry(registers.read(first + index * _ENTRY.size, _ENTRY.size))
        for index in range(count)
    )


def newest_first(entries: tuple[ManifestEntry, ...]) -> list[ManifestEntry]:
    """Those that describe the device, by schema and file version; unknown formats come last.

    Where the camera says that none does, all of them, since one has to.
    """
    about_device = [entry for entry in entries if entry.describes_device]
    return sorted(
        about_device or entries,
        key=lambda entry: (
            entry.file_format in tuple(FileFormat),
            entry.schema_version,
            entry.file_version,
        ),
        reverse=True,
    )
