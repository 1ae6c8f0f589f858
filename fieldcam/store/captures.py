"""A capture: two image files named by their content, and a row with the camera's facts.

The row is written last and durably, so a capture that has one is complete.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

from fieldcam.disk.raw_images import decode_raw, encode_raw, raw_suffix
from fieldcam.errors import ImageUnreadable, StorageError
from fieldcam.store.folder import DataFolder, DataKind
from fieldcam.store.objects import Objects
from fieldcam.store.queries.lookups import capture_facts
from fieldcam.values import ImageU8, PixelFormat, RawPair

Decode = Callable[[bytes, str], ImageU8]
"""Makes an image of a file's content; the file's name is for the error's sentence."""


@dataclass(frozen=True, slots=True)
class SavedCapture:
    """A raw pair that is safe on the disk."""

    key: str
    """UUID made when it was saved."""
    left: Path
    right: Path
    record: Path
    """The database, which holds the camera's facts."""
    calibration: Path | None = None
    """The file it came with, where it was imported; None: that of the camera in use."""


def load_raw(saved: SavedCapture, decode: Decode = decode_raw) -> RawPair:
    """Read a saved pair back.

    What is imported may be PNG or JPEG, which `decode` must know then.
    """
    facts = capture_facts(saved.record, saved.key)
    try:
        left, right = saved.left.read_bytes(), saved.right.read_bytes()
    except OSError as error:
        raise StorageError(f"Capture {saved.key} cannot be read back: {error}.") from error
    for eye, path, content in (("left", saved.left, left), ("right", saved.right, right)):
        if sha256(content).hexdigest() != path.name.partition(".")[0]:
            raise ImageUnreadable(
                f"The {eye} image of this picture is damaged: its file is not what was saved.",
                "Import the original again, or copy it back from another copy of the data folder.",
            )
    return RawPair(
        left=decode(left, saved.left.name),
        right=decode(right, saved.right.name),
        pixel_format=PixelFormat(facts["pixel_format"]),
        taken_at=datetime.fromisoformat(facts["taken_at"]),
        left_timestamp_ns=facts["left_timestamp_ns"],
        right_timestamp_ns=facts["right_timestamp_ns"],
        left_serial=facts["left_serial"],
        right_serial=facts["right_serial"],
        trigger_ordinal=facts["trigger_ordinal"],
        simulated=bool(facts["simulated"]),
    )


def refuse_other_kind(folder: DataFolder, simulated: bool) -> None:
    """Keep simulated captures out of real data, and real ones out of simulated data."""
    if simulated != (folder.kind is DataKind.SIMULATED):
        raise StorageError(
            f"{folder.path} is for {folder.kind} captures only.",
            "Name another folder with --data.",
        )


def keep_image(objects: Objects, image: ImageU8) -> Path:
    """Make one raw image durable."""
    return objects.keep(encode_raw(image), raw_suffix(image))


def camera_facts(raw: RawPair) -> dict[str, Any]:
    """What the camera said about a pair, apart from its pixels."""
    return {
        "pixel_format": raw.pixel_format.value,
        "taken_at": raw.taken_at.isoformat(),
        "left_timestamp_ns": raw.left_timestamp_ns,
        "right_timestamp_ns": raw.right_timestamp_ns,
        "left_serial": raw.left_serial,
        "right_serial": raw.right_serial,
        "trigger_ordinal": raw.trigger_ordinal,
        "simulated": raw.simulated,
    }
