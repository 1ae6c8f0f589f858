"""Captures in a folder: two image files named by their content, then one small record.

The record is written last and durably, so a capture that has one is complete. It
is a JSON file here; `store.store` keeps rows of a database instead.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

from fieldcam.errors import StorageError
from fieldcam.store.durable import write_durably
from fieldcam.store.folder import DataFolder, DataKind
from fieldcam.store.objects import Objects
from fieldcam.store.raw_images import decode_raw, encode_raw, raw_suffix
from fieldcam.values import ImageU8, PixelFormat, RawPair


@dataclass(frozen=True, slots=True)
class SavedCapture:
    """A raw pair that is safe on the disk."""

    key: str
    """UUID made when it was saved."""
    left: Path
    right: Path
    record: Path
    """What holds the camera's facts: a JSON file, or the database."""


class CaptureFolder:
    """Keeps raw pairs in a data folder."""

    def __init__(self, folder: DataFolder) -> None:
        self._folder = folder
        self._objects = Objects(folder.path)

    def save(self, raw: RawPair) -> SavedCapture:
        """Make a raw pair durable; when this returns, no crash can lose it."""
        refuse_other_kind(self._folder, raw.simulated)
        left, right = keep_image(self._objects, raw.left), keep_image(self._objects, raw.right)
        key = str(uuid4())
        record = self._folder.path / "captures" / f"{key}.json"
        facts = {"left": left.name, "right": right.name, **camera_facts(raw)}
        write_durably(record, json.dumps(facts, indent=1).encode())
        return SavedCapture(key, left, right, record)


def load_raw(saved: SavedCapture) -> RawPair:
    """Read a saved pair back."""
    try:
        facts = _facts_of(saved)
        left, right = saved.left.read_bytes(), saved.right.read_bytes()
    except (OSError, ValueError) as error:
        raise StorageError(f"Capture {saved.key} cannot be read back: {error}.") from error
    return RawPair(
        left=decode_raw(left, saved.left.name),
        right=decode_raw(right, saved.right.name),
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


def _facts_of(saved: SavedCapture) -> dict[str, Any]:
    if saved.record.suffix != ".json":
        # Only captures in a database need SQLite, which takes a while to load.
        from fieldcam.store.lookups import capture_facts

        return capture_facts(saved.record, saved.key)
    facts: dict[str, Any] = json.loads(saved.record.read_bytes())
    return facts
