"""Takes pairs into a folder of captures, without a walk, a database or an analysis."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from time import perf_counter

import numpy as np

from fieldcam.camera.port import DEADLINE_S, FlashStereoDevice
from fieldcam.disk.durable import write_durably
from fieldcam.errors import StorageError
from fieldcam.exchange.capture_folder import VIEW_FILE, CaptureFile, recording_day
from fieldcam.values import ImageU8, RawPair, ReasonCode, StereoPair

CLIPPED_FROM = 255
"""A pixel of this value may have been lit by any amount of light."""


@dataclass(frozen=True, slots=True)
class EyeLight:
    """How bright one eye's image is, as the sensor gave it."""

    mean: float
    """0 to 255."""
    clipped_fraction: float


@dataclass(frozen=True, slots=True, eq=False)
class Grabbed:
    """One pair that was taken and written."""

    raw: RawPair
    file: CaptureFile
    took_ms: float
    """From the command to the pair in memory, the exposure included."""
    saved_ms: float
    left: EyeLight
    right: EyeLight
    eyes: ReasonCode | None
    """SWAPPED_EYES or MISPAIRED where the pictures speak against the eyes' order."""


def grab_pairs(
    camera: FlashStereoDevice, folder: Path, tag_id: int, count: int
) -> Iterator[Grabbed]:
    """Take pairs one after the other, each written before the next one is taken.

    They go on from the tag's views that the folder holds already. Raises as the
    camera's `capture` does, and StorageError where a pair cannot be written; there is
    never one eye of a pair without the other.
    """
    from fieldcam.calibration.rectification import develop

    for _ in range(count):
        started_s = perf_counter()
        raw = camera.capture(DEADLINE_S)
        taken_s = perf_counter()
        pair = develop(raw)
        file = _write(pair, raw.taken_at, folder, tag_id)
        saved_s = perf_counter()
        yield Grabbed(
            raw,
            file,
            (taken_s - started_s) * 1000,
            (saved_s - taken_s) * 1000,
            _light(raw.left),
            _light(raw.right),
            _out_of_order(pair),
        )


def _light(image: ImageU8) -> EyeLight:
    return EyeLight(float(np.mean(image)), float(np.mean(image >= CLIPPED_FROM)))


def _out_of_order(pair: StereoPair) -> ReasonCode | None:
    """Where what both eyes see lies further right in the right one, or in one of them only."""
    from fieldcam.images.grey import as_grey
    from fieldcam.vision.judging.eye_matches import match_eyes
    from fieldcam.vision.judging.eyes import eyes_out_of_order
    from fieldcam.vision.judging.quality import middle

    matches = match_eyes(as_grey(pair.left), as_grey(pair.right), middle(*pair.size_px))
    finding = eyes_out_of_order(matches)
    return None if finding is None else finding[1].code


def _write(pair: StereoPair, taken_at: datetime, folder: Path, tag_id: int) -> CaptureFile:
    """In colour: a file of sensor values would not say which colour filter it had."""
    from fieldcam.exchange.images import encode_png

    day = recording_day(taken_at.astimezone())
    view = _next_view(folder / day.isoformat(), tag_id)
    left, right = (
        folder / day.isoformat() / f"{tag_id}_{view}_{eye}.png" for eye in ("left", "right")
    )
    try:
        write_durably(left, encode_png(pair.left))
        write_durably(right, encode_png(pair.right))
    except StorageError:
        with suppress(OSError):
            left.unlink(missing_ok=True)
        raise
    return CaptureFile(day, tag_id, view, left, right, None, taken_at)


def _next_view(day: Path, tag_id: int) -> int:
    names = (VIEW_FILE.fullmatch(path.stem) for path in day.glob("*"))
    return 1 + max((int(n[2]) for n in names if n and int(n[1]) == tag_id), default=0)
