"""Chunks: small records that a camera puts behind an image, such as its exposure time. Pure."""

from __future__ import annotations

import struct

from fieldcam.camera.usb3vision.transport import Bytes
from fieldcam.errors import FrameIncomplete

_RECORD_END = struct.Struct("<II")


def parse_chunks(payload: Bytes, image_bytes: int) -> dict[int, Bytes]:
    """Views of all chunks by their id, without a copy.

    Each record ends with its id and length, so they are walked from the end of the
    valid payload down to the image, which in some cameras is a record of its own.
    Raises FrameIncomplete where the records do not fit into the payload.
    """
    chunks: dict[int, Bytes] = {}
    end = len(payload)
    while end > image_bytes:
        stop = end - _RECORD_END.size
        if stop < 0:
            break
        chunk_id, length = _RECORD_END.unpack(payload[stop:end].tobytes())
        end = stop - length
        chunks[chunk_id] = payload[end:stop]
    if end not in (0, image_bytes):
        raise FrameIncomplete("The records behind a picture are damaged.", "Take it again.")
    return chunks
