"""The camera's own description: fetched from its memory, or from the user's cache.

A megabyte takes a thousand questions to the camera, so files are kept under the SHA-1
that the manifest gives; a kept file that does not have it any more is fetched again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from fieldcam.camera.genapi import FeatureFile, load_feature_file
from fieldcam.camera.genapi.registers import Registers
from fieldcam.camera.usb3vision.manifest import ManifestEntry
from fieldcam.disk.durable import write_durably
from fieldcam.errors import (
    BadInput,
    CameraRefused,
    CameraUnsupported,
    FeatureFileInvalid,
    FieldcamError,
    StorageError,
)
from fieldcam.foreign.bounds import FEATURES
from fieldcam.foreign.files import read_foreign
from fieldcam.user_folders import UserFolder, temporary_folder, user_folder


@dataclass(frozen=True, slots=True, eq=False)
class Description:
    """The features that a camera has."""

    content: bytes
    """As it lies in the camera or in the given file, zipped or not."""
    document: FeatureFile
    note: str = ""
    """A sentence where it is not the camera's newest own file."""


def cache_folder() -> Path:
    """Where descriptions are kept between two sessions."""
    base = user_folder(UserFolder.CACHE) or temporary_folder()
    return base / "fieldcam" / "descriptions"


def describe(
    registers: Registers, entries: Iterable[ManifestEntry], cache: Path, given: Path | None = None
) -> Description:
    """By the first of `entries` that can be read, else by the file that the operator gave.

    Raises CameraUnsupported, with what is wrong with the first one.
    """
    trouble: FieldcamError = CameraUnsupported("The camera has no description of its features.")
    first = True
    for entry in entries:
        try:
            content = fetch_description(registers, entry, cache)
            note = "" if first else f"An older description is used: {trouble.message}"
            return Description(content, load_feature_file(content), note)
        except (CameraUnsupported, CameraRefused, FeatureFileInvalid) as error:
            trouble, first = (error if first else trouble), False
    if given is None:
        raise CameraUnsupported(trouble.message, trouble.hint) from trouble
    return _given(given, trouble)


def _given(path: Path, trouble: FieldcamError) -> Description:
    try:
        content = read_foreign(path, FEATURES)
        document = load_feature_file(content)
    except BadInput as error:
        raise CameraUnsupported(
            f"{trouble.message} The one that camera.toml names cannot be read either:"
            f" {error.message}",
            error.hint,
        ) from error
    return Description(content, document, f"{path.name} is used: {trouble.message}")


def fetch_description(registers: Registers, entry: ManifestEntry, cache: Path) -> bytes:
    """The file of this entry, as it is; raises CameraUnsupported where it cannot be one."""
    if not 1 <= entry.length <= FEATURES.most_bytes:
        raise CameraUnsupported(f"The camera's description has {entry.length} bytes.")
    content = _kept(entry, cache)
    if content is None:
        content = registers.read(entry.address, entry.length)
        _keep(entry, content, cache)
    return content


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
