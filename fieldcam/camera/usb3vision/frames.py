"""Received blocks and the memory that they lie in."""

from __future__ import annotations

import weakref
from collections import deque
from dataclasses import dataclass

import numpy as np

from fieldcam.camera.usb3vision.blocks import ImageInfo
from fieldcam.camera.usb3vision.transport import Bytes


@dataclass(frozen=True, slots=True, eq=False)
class UsbFrame:
    """One whole block, where the kernel put it."""

    block_id: int
    device_time_ns: int
    arrived_ns: int
    """Of the leader, on the host's monotonic clock."""
    payload_type: int
    image: ImageInfo | None
    payload: Bytes
    """As many bytes as the camera vouches for."""
    lost_before: int
    """Blocks that the camera sent between the one before and this one, and nobody got."""


class FramePool:
    """Memory for frames, used again once nothing refers to the old frame any more.

    Fresh memory costs a page fault for every 4 KiB, about as much as filling it.
    """

    def __init__(self, capacity: int, count: int) -> None:
        self._count = count
        self._capacity = capacity
        # Filled now, so that no page fault falls into a transfer.
        self._free = deque(bytearray(b"\1") * capacity for _ in range(count))

    def take(self) -> Bytes:
        """An array (capacity,) of bytes; never waits: it makes new memory if it must."""
        block = self._free.popleft() if self._free else bytearray(self._capacity)
        # All views of an array refer to the first one over its memory, so that one
        # lives as long as any of them.
        array = np.frombuffer(block, np.uint8)
        weakref.finalize(array, self._give_back, block).atexit = False
        return array

    def _give_back(self, block: bytearray) -> None:
        if len(self._free) < self._count:
            self._free.append(block)
