"""A USB camera at the level of bulk transfers, which misbehaves on command.

Only as much of a camera as the transport layers need: memory behind GenCP, and a
stream endpoint that plays a list of transfers. Time does not pass: a read with nothing
to give times out at once.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import Enum, auto

import numpy as np

from fieldcam.camera.usb3vision.transport import (
    Bytes,
    EndpointStalled,
    LinkFault,
    TransferFault,
    TransferOverflow,
    TransferTimeout,
)
from fieldcam.errors import DeviceError

HEADER = struct.Struct("<IHHHH")
U3VC = 0x43563355


class Mishap(Enum):
    """What becomes of one command."""

    LOST = auto()
    LATE = auto()
    """Its answer comes only with that to the next command."""
    PENDING = auto()
    GARBAGE = auto()
    CUT_OFF = auto()
    STALLED = auto()
    BABBLE = auto()
    BROKEN_LINK = auto()
    BUSY = auto()


FAULTS = {
    Mishap.STALLED: EndpointStalled("stalled"),
    Mishap.BABBLE: TransferOverflow("overflow"),
    Mishap.BROKEN_LINK: LinkFault("link"),
}


@dataclass
class ScriptedControl:
    """Both control endpoints, with the memory behind them."""

    memory: dict[int, int] = field(default_factory=dict)
    """Byte by address; other addresses are refused."""
    mishaps: Iterable[Mishap | None] = ()
    refusal: Callable[[int, int], int] = lambda address, length: 0
    """The status for a command at this address of this length."""
    gone: DeviceError | None = None
    halted: bool = False
    clears: int = 0
    requests: list[tuple[int, int, int, int]] = field(default_factory=list)
    """Command, request id, address, length."""
    longest_ack: int = 0

    def __post_init__(self) -> None:
        self._mishaps = deque(self.mishaps)
        self._answers: deque[bytes | TransferFault] = deque()
        self._late: list[bytes] = []

    def put(self, address: int, data: bytes) -> None:
        self.memory.update(enumerate(data, address))

    def write(self, data: bytes, timeout_s: float) -> None:
        self._check_gone()
        prefix, flags, command, length, request_id = HEADER.unpack_from(data)
        assert (prefix, flags) == (U3VC, 0x4000)
        assert len(data) == HEADER.size + length
        assert request_id != 0
        answer = self._answer(command, request_id, data[HEADER.size :])
        mishap = self._mishaps.popleft() if self._mishaps else None
        self._answers.extend([*self._late, *self._spoil(mishap, answer, request_id)])
        self._late = [answer] if mishap is Mishap.LATE else []

    def read(self, into: Bytes, timeout_s: float) -> int:
        assert timeout_s > 0
        self._check_gone()
        if self.halted:
            raise EndpointStalled("stalled")
        if not self._answers:
            raise TransferTimeout("nothing")
        answer = self._answers.popleft()
        if isinstance(answer, TransferFault):
            self.halted = isinstance(answer, EndpointStalled)
            raise answer
        if len(answer) > len(into):
            raise TransferOverflow("overflow")
        assert len(answer) % 512 or len(answer) in (0, len(into)), "the read would not end"
        into[: len(answer)] = np.frombuffer(answer, np.uint8)
        return len(answer)

    def halt(self) -> None:
        self.halted = True

    def clear_halt(self) -> None:
        self.halted = False
        self.clears += 1

    def _check_gone(self) -> None:
        if self.gone is not None:
            raise self.gone

    def _spoil(
        self, mishap: Mishap | None, answer: bytes, request_id: int
    ) -> list[bytes | TransferFault]:
        if mishap in (Mishap.LOST, Mishap.LATE):
            return []
        if mishap is Mishap.PENDING:
            pending = HEADER.pack(U3VC, 0, 0x0805, 4, request_id) + struct.pack("<HH", 0, 500)
            return [pending, pending, answer]
        if mishap is Mishap.GARBAGE:
            return [b"\xff" * 40, b"", answer]
        if mishap is Mishap.CUT_OFF:
            return [answer[:-1]]
        if mishap is Mishap.BUSY:
            return [HEADER.pack(U3VC, 0x8007, 0x0801, 0, request_id)]
        if mishap is not None:
            return [FAULTS[mishap]]
        return [answer]

    def _answer(self, command: int, request_id: int, payload: bytes) -> bytes:
        (address,) = struct.unpack_from("<Q", payload)
        data = payload[8:]
        length = struct.unpack_from("<HH", data)[1] if command == 0x0800 else len(data)
        self.requests.append((command, request_id, address, length))
        status = self.refusal(address, length)
        places = range(address, address + length)
        if not status and any(place not in self.memory for place in places):
            status = 0x8003
        if status:
            return HEADER.pack(U3VC, status, command + 1, 0, request_id)
        if command == 0x0800:
            content = bytes(self.memory[place] for place in places)
        else:
            self.put(address, data)
            content = struct.pack("<HH", 0, length)
        self.longest_ack = max(self.longest_ack, HEADER.size + len(content))
        return HEADER.pack(U3VC, 0, command + 1, len(content), request_id) + content


PACKET_BYTES = 1024


class ScriptedStream:
    """A stream endpoint at the level of packets, which play one after the other.

    As on the bus, a read ends when its window is full or with a packet shorter than
    the rest; nothing else parts one transfer from the next.
    """

    def __init__(self, transfers: Iterable[bytes | TransferFault] = ()) -> None:
        self.packets: deque[bytes | TransferFault] = deque()
        self.acts: list[str] = []
        self.send(*transfers)

    def send(self, *transfers: bytes | TransferFault) -> None:
        for transfer in transfers:
            if isinstance(transfer, TransferFault):
                self.packets.append(transfer)
            else:
                starts = range(0, max(1, len(transfer)), PACKET_BYTES)
                self.packets.extend(transfer[start : start + PACKET_BYTES] for start in starts)

    def read(self, into: Bytes, timeout_s: float) -> int:
        assert timeout_s > 0
        assert len(into) % PACKET_BYTES == 0
        if not self.packets:
            raise TransferTimeout("nothing")
        count = 0
        while count < len(into) and self.packets:
            packet = self.packets[0]
            if isinstance(packet, TransferFault):
                if count:
                    break
                self.packets.popleft()
                raise packet
            self.packets.popleft()
            into[count : count + len(packet)] = np.frombuffer(packet, np.uint8)
            count += len(packet)
            if len(packet) < PACKET_BYTES:
                break
        return count

    def halt(self) -> None:
        self.acts.append("halt")

    def clear_halt(self) -> None:
        self.acts.append("clear")


def leader(
    block_id: int,
    width: int,
    height: int,
    *,
    pixel_format: int = 0x01080009,
    timestamp_ns: int = 0,
    padding_x: int = 0,
    payload_type: int = 1,
) -> bytes:
    """An image's leader."""
    head = struct.pack("<IHHQHHQ", 0x4C563355, 0, 52, block_id, 0, payload_type, timestamp_ns)
    return head + struct.pack("<IIIIIHH", pixel_format, width, height, 0, 0, padding_x, 0)


def trailer(block_id: int, valid_bytes: int, height: int, status: int = 0) -> bytes:
    """An image's trailer."""
    return struct.pack("<IHHQHHQI", 0x54563355, 0, 32, block_id, status, 0, valid_bytes, height)


def cut(payload: bytes, transfer_bytes: int) -> list[bytes]:
    """A block's data as transfers of at most this length."""
    return [payload[at : at + transfer_bytes] for at in range(0, len(payload), transfer_bytes)]
