"""The current preview and its cue as two files, for screens of other processes.

`preview.pnm` is the picture as binary PGM or PPM, `preview.json` what is known of
it: `at` (UTC), `due`, `read`, `place_mm`, `range_mm`, `zone`, `moved_mm`, `still`,
`flash_ready`, `ready`, `problem`. Each is renamed into place, the picture first.
Both are gone while nobody aims; what a crash leaves behind is old by its `at`.
"""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fieldcam.disk.raw_images import decode_raw, encode_raw
from fieldcam.errors import ImageUnreadable
from fieldcam.session.aim.cue import Cue
from fieldcam.session.events import Previewed
from fieldcam.values import ImageU8

IMAGE_NAME, CUE_NAME = "preview.pnm", "preview.json"
VARIABLE = "XDG_RUNTIME_DIR"


def preview_folder(data: Path) -> Path:
    """Where the app on this data folder leaves its preview."""
    configured = Path(os.environ.get(VARIABLE, ""))
    if not configured.is_absolute():
        return data / "runtime"
    # Two apps may run at a time, on two data folders.
    mark = hashlib.sha256(os.fsencode(data.resolve())).hexdigest()[:8]
    return configured / "fieldcam" / mark


@dataclass(frozen=True, slots=True)
class PreviewFile:
    """The two files in a folder, which is made when it is missing."""

    folder: Path

    def keep_image(self, image: ImageU8) -> Path:
        """Gives its path; raises OSError where it cannot be written."""
        return self._keep(IMAGE_NAME, encode_raw(image))

    def keep_cue(self, cue: Cue) -> Path:
        """Raises OSError where it cannot be written."""
        document = {
            "at": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "due": cue.due,
            "read": cue.read,
            "place_mm": cue.place_mm,
            "range_mm": None if cue.range_mm is None else round(cue.range_mm, 1),
            "zone": cue.zone,
            "moved_mm": None if cue.moved_mm is None else round(cue.moved_mm, 1),
            "still": cue.still,
            "flash_ready": cue.flash_ready,
            "ready": cue.ready,
            "problem": cue.problem,
        }
        return self._keep(CUE_NAME, json.dumps(document).encode() + b"\n")

    def written_s(self) -> float | None:
        """When the cue was written, in seconds since 1970; None where there is none."""
        with suppress(OSError):
            return (self.folder / CUE_NAME).stat().st_mtime
        return None

    def load(self) -> Previewed | None:
        """What was seen last; None where that cannot be read."""
        try:
            document = json.loads((self.folder / CUE_NAME).read_bytes())
            picture = decode_raw((self.folder / IMAGE_NAME).read_bytes(), IMAGE_NAME)
            return Previewed(picture, _cue(document))
        except (OSError, ValueError, KeyError, TypeError, ImageUnreadable):
            return None

    def remove(self) -> None:
        """Raises OSError where they cannot be removed."""
        for name in (CUE_NAME, IMAGE_NAME):
            (self.folder / name).unlink(missing_ok=True)

    def _keep(self, name: str, content: bytes) -> Path:
        self.folder.mkdir(parents=True, exist_ok=True)
        path, part = self.folder / name, self.folder / f".{name}.part"
        part.write_bytes(content)
        return part.replace(path)


def _cue(document: dict[str, Any]) -> Cue:
    place_mm = document["place_mm"]
    return Cue(
        due=document["due"],
        read=tuple(document["read"]),
        place_mm=None if place_mm is None else tuple(place_mm),
        moved_mm=document["moved_mm"],
        flash_ready=document["flash_ready"],
        problem=document["problem"],
    )
