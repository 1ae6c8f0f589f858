"""The camera's GenICam XML: fetched from its memory, or from the user's cache.

A megabyte takes a thousand questions to the camera, so files are kept under the SHA-1
that the manifest gives; a kept file that does not have it any more is fetched again.
"""

from __future__ import annotations

import hashlib
import io
import os
import zipfile
import zlib
from contextlib import suppress
from pathlib import Path
from typing import IO

from fieldcam.camera.genapi.registers import Registers
from fieldcam.camera.usb3vision.manifest import FileFormat, ManifestEntry
from fieldcam.errors import CameraUnsupported, StorageError
from fieldcam.store.durable import write_durably

LONGEST_BYTES = 16 << 20
"""Of a description, packed or not; the longest known are near 2 MB."""


def cache_folder() -> Path:
    """Where descriptions are kept between two sessions."""
    configured = Path(os.environ.get("XDG_CACHE_HOME", ""))
    base = configured if configured.is_absolute() else Path.home() / ".cache"
    return base / "fieldcam" / "descriptions"


def fetch_description(registers: Registers, entry: ManifestEntry, cache: Path) -> bytes:
    """The XML of this entry; raises CameraUnsupported where it cannot be one."""
    if not 1 <= entry.length <= LONGEST_BYTES:
        raise CameraUnsupported(f"The camera's description has {entry.length} bytes.")
    content = _kept(entry, cache)
    if content is None:
        content = registers.read(entry.address, entry.length)
        _keep(entry, content, cache)
    return unpack(content, entry.file_format)


def unpack(content: bytes, file_format: int) -> bytes:
    """The XML in a file of the camera."""
    if file_format == FileFormat.XML:
        return content.rstrip(b"\0")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive, _only_file(archive) as stream:
            xml = stream.read(LONGEST_BYTES + 1)
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, OSError, ValueError) as error:
        raise CameraUnsupported(f"The camera's description cannot be unpacked: {error}.") from error
    if len(xml) > LONGEST_BYTES:
        raise CameraUnsupported(f"The camera's description unpacks to over {LONGEST_BYTES} bytes.")
    return xml


def _only_file(archive: zipfile.ZipFile) -> IO[bytes]:
    # Not `is_dir`, which fails on an empty name.
    files = [info for info in archive.infolist() if not info.filename.endswith("/")]
    if len(files) != 1:
        raise CameraUnsupported(f"The camera's description is an archive of {len(files)} files.")
    if files[0].compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise CameraUnsupported("The camera's description is compressed in an unknown way.")
    return archive.open(files[0])


def _kept(entry: ManifestEntry, cache: Path) -> bytes | None:
    if entry.sha1 is None:
        return None
    with suppress(OSError):
        content = _kept_path(entry.sha1, cache).read_bytes()
        if _is_whole(content, entry):
            return content
    return None


def _keep(entry: ManifestEntry, content: bytes, cache: Path) -> None:
    """Only what has the hash that it is looked up by; a full disk is no reason to fail."""
    if entry.sha1 is not None and _is_whole(content, entry):
        with suppress(StorageError):
            write_durably(_kept_path(entry.sha1, cache), content)


def _is_whole(content: bytes, entry: ManifestEntry) -> bool:
    return hashlib.sha1(content, usedforsecurity=False).digest() == entry.sha1


def _kept_path(sha1: bytes, cache: Path) -> Path:
    return cache / sha1.hex()
