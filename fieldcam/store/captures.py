"""Captures in a folder: two image files named by their content, then one small record.

The record is written last and durably, so a capture that has one is complete.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import uuid4

from fieldcam.errors import StorageError
from fieldcam.store.durable import write_durably
from fieldcam.store.folder import DataFolder, DataKind
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


class CaptureFolder:
    """Keeps raw pairs in a data folder."""

    def __init__(self, folder: DataFolder) -> None:
        self._folder = folder

    def save(self, raw: RawPair) -> SavedCapture:
        """Make a raw pair durable; when this returns, no crash can lose it."""
        if raw.simulated != (self._folder.kind is DataKind.SIMULATED):
            raise StorageError(
                f"{self._folder.path} is for {self._folder.kind} captures only.",
                "Name another folder with --data.",
            )
        left, right = self._save_image(raw.left), self._save_image(raw.right)
        key = str(uuid4())
        record = self._folder.path / "captures" / f"{key}.json"
        write_durably(record, json.dumps(_facts(raw, left, right), indent=1).encode())
        return SavedCapture(key, left, right, record)

    def _save_image(self, image: ImageU8) -> Path:
        content = encode_raw(image)
        digest = sha256(content).hexdigest()
        path = self._folder.path / "objects" / digest[:2] / (digest + raw_suffix(image))
        if not path.exists():
            write_durably(path, content)
        return path


def load_raw(saved: SavedCapture) -> RawPair:
    """Read a saved pair back."""
    try:
        facts: dict[str, Any] = json.loads(saved.record.read_bytes())
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
        simulated=facts["simulated"],
    )


def _facts(raw: RawPair, left: Path, right: Path) -> dict[str, Any]:
    return {
        "left": left.name,
        "right": right.name,
        "pixel_format": raw.pixel_format.value,
        "taken_at": raw.taken_at.isoformat(),
        "left_timestamp_ns": raw.left_timestamp_ns,
        "right_timestamp_ns": raw.right_timestamp_ns,
        "left_serial": raw.left_serial,
        "right_serial": raw.right_serial,
        "trigger_ordinal": raw.trigger_ordinal,
        "simulated": raw.simulated,
    }
