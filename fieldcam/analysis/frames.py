"""JSON documents on a stream of bytes: four bytes of length, then the text in UTF-8."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

_LENGTH = struct.Struct(">I")
LONGEST_BYTES = 64 << 20
"""A reading takes about one megabyte; whatever announces more than this is none."""


class FrameInvalid(Exception):
    """The stream holds something else than frames."""


def frame(document: object) -> bytes:
    """One document as it travels; NaN is refused, since JSON knows none."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    if len(text) > LONGEST_BYTES:
        raise FrameInvalid(f"A frame of {len(text)} bytes is too long.")
    return _LENGTH.pack(len(text)) + text


class Frames:
    """Puts documents together from bytes that come in pieces of any size."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, piece: bytes) -> Iterator[Any]:
        """The documents that this piece completes."""
        self._buffer += piece
        while (end := self._end()) <= len(self._buffer):
            text = bytes(self._buffer[_LENGTH.size : end])
            del self._buffer[:end]
            yield _document(text)

    def _end(self) -> int:
        """How many bytes the first frame needs, as far as is known."""
        if len(self._buffer) < _LENGTH.size:
            return _LENGTH.size + 1
        length: int = _LENGTH.unpack_from(self._buffer)[0]
        if not 0 < length <= LONGEST_BYTES:
            raise FrameInvalid(f"A frame announces {length} bytes.")
        return _LENGTH.size + length


def _document(text: bytes) -> object:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise FrameInvalid("A frame is no JSON.") from error
