"""What a camera may send with an image: facts about the exposure, each behind the pixels."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from .features import CHUNK_IDS, CHUNKS, SOURCE_CHUNK_ID
from .pictures import Image
from .protocol import CHUNK_TAIL
from .settings import Settings

IMAGE_CHUNK_ID = 0x0001


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """About one exposure."""

    block_id: int = 0
    timestamp_ns: int = 0
    exposure_us: float = 0.0
    gain_db: float = 0.0
    lines: int = 0
    """A bit for each line that was up."""
    source: int | None = None
    """Which component of the head the image is of."""


def with_chunks(image: Image, facts: Facts, settings: Settings) -> memoryview:
    """The payload of a block: the pixels, and the chunks where they are switched on."""
    pixels = image.reshape(-1).data
    if not settings.integer("ChunkModeActive"):
        return pixels
    values = {
        "FrameID": struct.pack("<Q", facts.block_id),
        "Timestamp": struct.pack("<Q", facts.timestamp_ns),
        "ExposureTime": struct.pack("<d", facts.exposure_us),
        "Gain": struct.pack("<d", facts.gain_db),
        "LineStatusAll": struct.pack("<Q", facts.lines),
    }
    found = bytearray(pixels) + CHUNK_TAIL.pack(IMAGE_CHUNK_ID, len(pixels))
    for name, index in CHUNKS.items():
        if settings.integer("ChunkEnable", index):
            found += values[name] + CHUNK_TAIL.pack(CHUNK_IDS[name], len(values[name]))
    if facts.source is not None:
        found += struct.pack("<Q", facts.source) + CHUNK_TAIL.pack(SOURCE_CHUNK_ID, 8)
    return memoryview(found)
