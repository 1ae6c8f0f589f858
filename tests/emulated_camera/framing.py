"""One block on the stream endpoint: leader, payload transfers, final transfers, trailer."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from dataclasses import dataclass

from .faults import Fault, Faults
from .pipes import Outgoing
from .protocol import (
    CHUNK_LAYOUT,
    LEADER,
    LEADER_PREFIX,
    TRAILER,
    TRAILER_PREFIX,
    Payload,
    Status,
)

OVERSHOOT = 1024
"""Bytes that a babbling device sends too much; a packet of a SuperSpeed endpoint."""
_MISSING = 4096
"""Bytes that a short frame lacks."""


@dataclass(frozen=True, slots=True)
class TransferSizes:
    """What the host wrote to the stream interface's registers, in bytes."""

    payload: int
    count: int
    final_1: int
    final_2: int

    @property
    def total(self) -> int:
        return self.payload * self.count + self.final_1 + self.final_2

    def cut(self, data: memoryview) -> Iterator[memoryview]:
        """The payload transfers of a block; the last one may be short."""
        for size in (*[self.payload] * self.count, self.final_1, self.final_2):
            if not data:
                return
            if size:
                yield data[:size]
                data = data[size:]


@dataclass(frozen=True, slots=True)
class Frame:
    """One image on its way out."""

    block_id: int
    timestamp_ns: int
    pixel_format: int
    width: int
    height: int
    offset_x: int
    offset_y: int
    data: memoryview
    """Image, then chunks."""
    has_chunks: bool

    @property
    def leader(self) -> bytes:
        kind = Payload.IMAGE_WITH_CHUNKS if self.has_chunks else Payload.IMAGE
        return LEADER.pack(
            LEADER_PREFIX,
            0,
            LEADER.size,
            self.block_id,
            0,
            kind,
            self.timestamp_ns,
            self.pixel_format,
            self.width,
            self.height,
            self.offset_x,
            self.offset_y,
            0,
            0,
        )

    def trailer(self, status: Status) -> bytes:
        tail = CHUNK_LAYOUT.pack(1) if self.has_chunks else b""
        size = TRAILER.size + len(tail)
        valid = len(self.data)
        fields = (TRAILER_PREFIX, 0, size, self.block_id, status, 0, valid, self.height)
        return TRAILER.pack(*fields) + tail


def transfers(frame: Frame, sizes: TransferSizes, faults: Faults) -> list[Outgoing]:
    """All transfers of a block, spoiled as the faults want; none of them has its time yet."""
    pieces = [Outgoing(piece, 0) for piece in sizes.cut(frame.data)]
    _spoil_payload(pieces, frame, faults)
    leader = [] if faults.strikes(Fault.NO_LEADER) else [Outgoing(memoryview(frame.leader), 0)]
    trailer = memoryview(frame.trailer(_status(faults)))
    ending = [] if faults.strikes(Fault.NO_TRAILER) else [Outgoing(trailer, 0)]
    return leader + pieces + ending


def _status(faults: Faults) -> Status:
    if faults.strikes(Fault.DISCARDED):
        return Status.DATA_DISCARDED
    if faults.strikes(Fault.OVERRUN):
        return Status.DATA_OVERRUN
    return Status.SUCCESS


def _spoil_payload(pieces: list[Outgoing], frame: Frame, faults: Faults) -> None:
    last, middle = pieces[-1], pieces[len(pieces) // 2]
    if faults.strikes(Fault.SHORT_FRAME):
        last.data = last.data[: max(1, len(last.data) - _MISSING)]
    if faults.strikes(Fault.LONG_FRAME):
        pieces.append(Outgoing(memoryview(bytes(OVERSHOOT)), 0))
    if faults.strikes(Fault.MAGIC_IN_PAYLOAD):
        middle.data = memoryview(frame.leader + bytes(middle.data[LEADER.size :]))
    if faults.strikes(Fault.BABBLE):
        middle.error = errno.EOVERFLOW
    if faults.strikes(Fault.LINK_ERROR):
        middle.error = errno.EPROTO
    if faults.strikes(Fault.STALL):
        middle.data, middle.error = memoryview(b""), errno.EPIPE
    if faults.strikes(Fault.UNPLUG_MID_FRAME):
        middle.data, middle.error = memoryview(b""), errno.ENODEV
