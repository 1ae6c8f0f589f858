"""Leader, data, trailer: puts received transfers together to frames. Pure.

The reader asks for a window, has one transfer put there, and says how many bytes came.
A transfer out of order spoils the frame under way; whatever is no leader is then
dropped until the next one. Only a frame that its trailer vouches for is handed on.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from fieldcam.camera.usb3vision.blocks import (
    Leader,
    Trailer,
    parse_leader,
    parse_trailer,
    trailer_at_end,
)
from fieldcam.camera.usb3vision.frames import FramePool, UsbFrame
from fieldcam.camera.usb3vision.gencp import GencpStatus, describe
from fieldcam.camera.usb3vision.transfer_plan import TransferPlan
from fieldcam.camera.usb3vision.transport import MAX_PACKET_BYTES, Bytes, round_up

_TAIL_BYTES = 64


class TransferState(Enum):
    """What the next transfer should be."""

    LOST = auto()
    """Anything; the first one that ends with a short packet ends a block, or part of it."""
    LEADER = auto()
    PAYLOAD = auto()
    TRAILER = auto()


@dataclass(frozen=True, slots=True)
class SpoiledFrame:
    """A block that did not arrive whole."""

    block_id: int
    reason: str
    """Goes on after `The picture`, as in `has no trailer`."""


@dataclass(slots=True)
class StreamCounts:
    """What became of everything since the stream was armed."""

    frames: int = 0
    spoiled: int = 0
    lost: int = 0
    """Blocks that never came, by the gaps between block ids."""


@dataclass(slots=True)
class _Block:
    """The block under way."""

    leader: Leader
    arrived_ns: int
    lost_before: int
    memory: Bytes
    received: int = 0
    transfers: int = 0
    has_empty_end: bool = False


class FrameAssembler:
    """The state of one armed stream."""

    def __init__(self, plan: TransferPlan, pool: FramePool) -> None:
        self._windows = plan.windows
        self._pool = pool
        # Larger windows could not tell a leader of whole packets from the data behind it.
        self._header_bytes = round_up(max(plan.leader, plan.trailer), MAX_PACKET_BYTES)
        self._scratch: Bytes = np.empty(max(self._header_bytes, *plan.windows), np.uint8)
        self._block: _Block | None = None
        self._state = TransferState.LEADER
        self._last_id: int | None = None
        self.counts = StreamCounts()

    @property
    def in_block(self) -> bool:
        """A leader came, and its trailer not yet."""
        return self._block is not None

    def window(self) -> Bytes:
        """Where the next transfer is to go; never empty."""
        if self._state is TransferState.LOST:
            return self._scratch
        if self._block is None or self._state is TransferState.TRAILER:
            return self._scratch[: self._header_bytes]
        start = self._block.received
        return self._block.memory[start : start + self._windows[self._block.transfers]]

    def received(self, count: int, now_ns: int) -> UsbFrame | SpoiledFrame | None:
        """Take in `count` bytes in the window; gives a frame or its end, if this was it."""
        if self._block is None:
            self._lead(count, now_ns)
            return None
        if self._state is TransferState.TRAILER:
            return self._trail(self._block, self._scratch[:count].tobytes(), now_ns)
        return self._fill(self._block, count, now_ns)

    def abandon(self, reason: str) -> SpoiledFrame | None:
        """The transfer failed; gives the frame that this costs, if one was under way."""
        block, self._block = self._block, None
        self._state = TransferState.LEADER
        if block is None:
            return None
        self.counts.spoiled += 1
        return SpoiledFrame(block.leader.block_id, reason)

    def _lead(self, count: int, now_ns: int) -> None:
        ended = count < len(self.window())
        leader = parse_leader(self._scratch[:count].tobytes()) if self._is_header(count) else None
        if leader is not None:
            self._begin(leader, now_ns)
            return
        self._state = TransferState.LEADER if ended else TransferState.LOST

    def _is_header(self, count: int) -> bool:
        """Whether so many bytes can be a leader or a trailer and nothing else."""
        return count <= self._header_bytes

    def _begin(self, leader: Leader, now_ns: int) -> None:
        lost = 0
        # Block ids begin anew with each acquisition.
        if self._last_id is not None and leader.block_id > self._last_id:
            lost = leader.block_id - self._last_id - 1
        self._last_id = leader.block_id
        self.counts.lost += lost
        self._block = _Block(leader, now_ns, lost, self._pool.take())
        self._state = TransferState.PAYLOAD

    def _fill(self, block: _Block, count: int, now_ns: int) -> UsbFrame | SpoiledFrame | None:
        start = block.received
        full = count == self._windows[block.transfers]
        block.received += count
        block.transfers += 1
        if full and block.transfers < len(self._windows):
            return None
        self._state = TransferState.TRAILER
        return None if full else self._look_into(block, start, now_ns)

    def _look_into(self, block: _Block, start: int, now_ns: int) -> UsbFrame | SpoiledFrame | None:
        """A transfer that came short may be the rest of the data, or what follows them."""
        transfer = block.memory[start : block.received]
        if self._is_header(len(transfer)):
            leader = parse_leader(transfer.tobytes())
            if leader is not None:
                return self._cut_off(leader, now_ns)
        tail = transfer[-_TAIL_BYTES:]
        found = trailer_at_end(tail.tobytes())
        if found is None or found[0].block_id != block.leader.block_id:
            return None
        trailer, before = found
        block.received -= len(tail) - before
        return self._finish(block, trailer)

    def _trail(self, block: _Block, transfer: bytes, now_ns: int) -> UsbFrame | SpoiledFrame | None:
        trailer = parse_trailer(transfer)
        if trailer is not None and trailer.block_id == block.leader.block_id:
            return self._finish(block, trailer)
        if (leader := parse_leader(transfer)) is not None:
            return self._cut_off(leader, now_ns)
        if not transfer and not block.has_empty_end:
            # A camera may end data that fill their last packet by an empty one.
            block.has_empty_end = True
            return None
        return self.abandon("has no trailer")

    def _cut_off(self, leader: Leader, now_ns: int) -> SpoiledFrame | None:
        spoiled = self.abandon("was cut off by the next one")
        self._begin(leader, now_ns)
        return spoiled

    def _finish(self, block: _Block, trailer: Trailer) -> UsbFrame | SpoiledFrame | None:
        if (fault := _fault(block, trailer)) is not None:
            return self.abandon(fault)
        self._block = None
        self._state = TransferState.LEADER
        self.counts.frames += 1
        leader = block.leader
        return UsbFrame(
            leader.block_id,
            leader.timestamp_ns,
            block.arrived_ns,
            leader.payload_type,
            leader.image,
            block.memory[: trailer.valid_bytes],
            block.lost_before,
        )


def _fault(block: _Block, trailer: Trailer) -> str | None:
    """Why a block is not whole, in the words of SpoiledFrame."""
    image = block.leader.image
    if trailer.status != GencpStatus.OK:
        return f"was given up by the camera: {describe(trailer.status)}"
    if trailer.valid_bytes > block.received:
        return f"came with {block.received} of {trailer.valid_bytes} bytes"
    if image is not None and image.size_bytes > trailer.valid_bytes:
        return f"holds only {trailer.valid_bytes} of {image.size_bytes} bytes"
    if image is not None and trailer.height_px is not None and trailer.height_px < image.height_px:
        return f"holds only {trailer.height_px} of {image.height_px} rows"
    return None
