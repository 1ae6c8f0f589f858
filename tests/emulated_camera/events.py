"""What the camera tells by itself on its event channel."""

from __future__ import annotations

from .protocol import EVENT, EVENT_PREFIX, HEADER, Command


def event(number: int, timestamp_ns: int, data: bytes) -> bytes:
    """One event packet; no answer is wanted."""
    payload = EVENT.pack(0, number, timestamp_ns) + data
    return HEADER.pack(EVENT_PREFIX, 0, Command.EVENT, len(payload), 0) + payload
