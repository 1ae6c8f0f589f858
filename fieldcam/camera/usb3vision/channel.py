"""The control channel: the camera's memory, read and written over GenCP.

One command is under way at a time. An acknowledgement that is lost, late or damaged
costs one more attempt under a new request id; whatever answers an older id is dropped.
A write that makes the camera act, such as a trigger, is sent once only.
"""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np

from fieldcam.camera.usb3vision.gencp import (
    HEADER_BYTES,
    PENDING_ACK_BYTES,
    WRITE_OVERHEAD_BYTES,
    Ack,
    GencpStatus,
    MalformedPacket,
    describe,
    pack_read,
    pack_write,
    parse_ack,
)
from fieldcam.camera.usb3vision.transport import (
    MAX_PACKET_BYTES,
    BulkIn,
    BulkOut,
    EndpointStalled,
    TransferFault,
    TransferTimeout,
    round_up,
)
from fieldcam.errors import CameraRefused, CameraSilent
from fieldcam.words import number_of

ATTEMPTS = 5
"""As many as aravis makes; one only of a camera that answered none of them, until it does."""
BUSY_PAUSE_S = 0.02
LONGEST_PENDING_S = 30.0
"""A camera that asks for more time again and again, beyond this, has hung."""

_HIGHEST_REQUEST_ID = 0xFFFF
_HIGH_SPEED_PACKET_BYTES = 512
_WORD_BYTES = 4
_MEMORY_END = 1 << 64
_TRY_AGAIN = (GencpStatus.BUSY, GencpStatus.MESSAGE_TIMEOUT)


@dataclass(frozen=True, slots=True)
class ChannelLimits:
    """What one camera can take."""

    command_bytes: int = WRITE_OVERHEAD_BYTES + 64
    """Longest command packet."""
    ack_bytes: int = HEADER_BYTES + 64
    """Longest acknowledgement packet."""
    response_s: float = 1.0
    """How long an answer may take."""


class _BadAlignment(CameraRefused):
    """The camera reads whole, aligned words only."""


class ControlChannel:
    """Registers of one camera; any thread may use them."""

    def __init__(self, out: BulkOut, into: BulkIn) -> None:
        self._out = out
        self._in = into
        self._lock = threading.Lock()
        # A program that crashed may have left answers behind, under low ids.
        self._request_id = random.randint(1, _HIGHEST_REQUEST_ID)
        self.limits = ChannelLimits()
        self._write_attempts = ATTEMPTS
        self._fell_silent = False

    @property
    def limits(self) -> ChannelLimits:
        """Small safe ones, until those are set that the camera's registers name."""
        return self._limits

    @limits.setter
    def limits(self, limits: ChannelLimits) -> None:
        self._limits = limits
        capacity = round_up(max(limits.ack_bytes, PENDING_ACK_BYTES), MAX_PACKET_BYTES)
        self._buffer = np.empty(capacity, np.uint8)

    def read(self, address: int, length: int) -> bytes:
        """Bytes of the camera's memory, in as many commands as it takes.

        Raises CameraRefused where the camera gives nothing there, CameraSilent where
        it does not answer, CameraUnplugged where it is gone.
        """
        _check_range(address, length)
        try:
            return self._read_in_chunks(address, length)
        except _BadAlignment:
            start = address - address % _WORD_BYTES
            end = round_up(address + length, _WORD_BYTES)
            if (start, end) == (address, address + length):
                raise
        return self._read_in_chunks(start, end - start)[address - start :][:length]

    def write(self, address: int, data: bytes) -> None:
        """Write into the camera's memory; raises as `read` does."""
        _check_range(address, len(data))
        step = _whole_words(self._limits.command_bytes - WRITE_OVERHEAD_BYTES)
        for offset in range(0, len(data), step):
            place, chunk = address + offset, data[offset : offset + step]
            command = partial(pack_write, address=place, data=chunk)
            ack = self._transact(command, PENDING_ACK_BYTES, self._write_attempts)
            if ack.status != GencpStatus.OK:
                raise _refusal(ack, f"to write {len(chunk)} bytes at 0x{place:X}")

    @contextmanager
    def acting(self) -> Iterator[None]:
        """Every write inside is sent once: the camera must not do it again because its
        answer was lost. CameraSilent then does not say whether it acted.
        """
        self._write_attempts = 1
        try:
            yield
        finally:
            self._write_attempts = ATTEMPTS

    def _read_in_chunks(self, address: int, length: int) -> bytes:
        step = _whole_words(self._limits.ack_bytes - HEADER_BYTES)
        return b"".join(
            self._read_chunk(address + offset, min(step, length - offset))
            for offset in range(0, length, step)
        )

    def _read_chunk(self, address: int, length: int) -> bytes:
        command = partial(pack_read, address=address, length=length)
        ack = self._transact(command, HEADER_BYTES + length, ATTEMPTS)
        if ack.status != GencpStatus.OK or len(ack.payload) != length:
            raise _refusal(ack, f"to give {length} bytes at 0x{address:X}")
        return ack.payload

    def _transact(self, command: Callable[[int], bytes], ack_bytes: int, attempts: int) -> Ack:
        """The camera's last word on one command, which is packed for each attempt anew.

        `attempts` bounds those that nothing answered; what a busy camera refused it did
        not do, so that is asked again in any case.
        """
        faults: list[TransferFault] = []
        with self._lock:
            attempts = 1 if self._fell_silent else attempts
            for _ in range(ATTEMPTS):
                try:
                    ack = self._attempt(command(self._next_id()), ack_bytes)
                except TransferFault as error:
                    faults.append(error)
                    self._recover(error)
                    if len(faults) == attempts:
                        break
                    continue
                self._fell_silent = False
                if ack.status not in _TRY_AGAIN:
                    return ack
                time.sleep(BUSY_PAUSE_S)
        if not faults:
            return ack
        self._fell_silent = self._fell_silent or attempts == ATTEMPTS
        raise CameraSilent(
            f"The camera answered none of {number_of(attempts, 'attempt')}.", "Plug it in again."
        ) from faults[-1]

    def _attempt(self, packet: bytes, ack_bytes: int) -> Ack:
        request_id = self._request_id
        self._out.write(packet, self._limits.response_s)
        start_s = time.monotonic()
        deadline_s = start_s + self._limits.response_s
        while (left_s := deadline_s - time.monotonic()) > 0:
            ack = self._receive(ack_bytes, left_s)
            if ack is None or ack.request_id != request_id:
                continue
            if not ack.is_pending:
                return ack
            deadline_s = min(time.monotonic() + ack.pending_s, start_s + LONGEST_PENDING_S)
        raise TransferTimeout("The camera did not answer a command in time.")

    def _receive(self, ack_bytes: int, timeout_s: float) -> Ack | None:
        """The next acknowledgement; None for bytes that are none."""
        # A read ends at a short packet or when it is full, so one that may be all full
        # packets must ask for its exact length; any other leaves room for a stale one.
        exact = ack_bytes % _HIGH_SPEED_PACKET_BYTES == 0
        window = self._buffer[:ack_bytes] if exact else self._buffer
        count = self._in.read(window, timeout_s)
        try:
            return parse_ack(window[:count].tobytes())
        except MalformedPacket:
            return None

    def _recover(self, fault: TransferFault) -> None:
        if isinstance(fault, EndpointStalled):
            self._out.clear_halt()
            self._in.clear_halt()

    def _next_id(self) -> int:
        """Never 0."""
        self._request_id = self._request_id % _HIGHEST_REQUEST_ID + 1
        return self._request_id


def _check_range(address: int, length: int) -> None:
    """A camera's own description may compute any address."""
    if address < 0 or length < 0 or address + length > _MEMORY_END:
        raise CameraRefused(f"No camera has {length} bytes at {address:#x}.")


def _whole_words(length: int) -> int:
    """Rounded down, so that every chunk begins as well aligned as the first one."""
    return max(_WORD_BYTES, length - length % _WORD_BYTES)


def _refusal(ack: Ack, what: str) -> CameraRefused:
    if ack.status == GencpStatus.OK:
        return CameraRefused(f"The camera was asked {what} and gave {len(ack.payload)}.")
    leaf = _BadAlignment if ack.status == GencpStatus.BAD_ALIGNMENT else CameraRefused
    why = describe(ack.status)
    return leaf(f"The camera refused {what}: {why}.", why=why)
