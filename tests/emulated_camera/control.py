"""The control channel: one GenCP command in, its acks out."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from .faults import Fault, Faults
from .protocol import (
    ACK_WANTED,
    CONTROL_PREFIX,
    HEADER,
    PENDING,
    READ_REQUEST,
    WRITE_ADDRESS,
    Command,
    Status,
)
from .registers import AddressSpace, Refused

MAX_COMMAND_BYTES = 1024
MAX_ACK_BYTES = 1024
PENDING_MS = 200
"""The time that a pending ack asks for."""
PENDING_TAKES_MS = 60
"""The time that the device then takes."""


@dataclass(frozen=True, slots=True)
class Reply:
    """An ack, and how long after the command it comes."""

    data: bytes
    after_ms: float = 0.0


class ControlChannel:
    """Carries commands out on the registers."""

    def __init__(self, space: AddressSpace, faults: Faults) -> None:
        self._space = space
        self._faults = faults

    def answer(self, command: bytes) -> list[Reply]:
        """What the device sends after one OUT transfer; nothing where it was not a command."""
        if len(command) < HEADER.size:
            return []
        prefix, flags, code, length, request = HEADER.unpack_from(command)
        if prefix != CONTROL_PREFIX:
            return []
        payload = command[HEADER.size :]
        status, result = self._outcome(code, length, payload)
        if not flags & ACK_WANTED:
            return []
        return list(self._replies(_ack(status, code + 1, request, result), request))

    def _outcome(self, code: int, length: int, payload: bytes) -> tuple[Status, bytes]:
        if length != len(payload) or HEADER.size + length > MAX_COMMAND_BYTES:
            return Status.INVALID_HEADER, b""
        if self._faults.strikes(Fault.BUSY):
            return Status.BUSY, b""
        try:
            return Status.SUCCESS, self._run(code, payload)
        except Refused as refused:
            return refused.status, b""

    def _run(self, code: int, payload: bytes) -> bytes:
        match code:
            case Command.READ if len(payload) == READ_REQUEST.size:
                address, _, count = READ_REQUEST.unpack(payload)
                if not 0 < count <= MAX_ACK_BYTES - HEADER.size:
                    raise Refused(Status.INVALID_PARAMETER)
                return self._space.read(address, count)
            case Command.WRITE if len(payload) > WRITE_ADDRESS.size:
                (address,) = WRITE_ADDRESS.unpack_from(payload)
                data = payload[WRITE_ADDRESS.size :]
                self._space.write(address, data)
                return struct.pack("<HH", 0, len(data))
            case Command.READ | Command.WRITE:
                raise Refused(Status.INVALID_PARAMETER)
        raise Refused(Status.NOT_IMPLEMENTED)

    def _replies(self, ack: bytes, request: int) -> Iterator[Reply]:
        if self._faults.strikes(Fault.NO_ACK):
            return
        if self._faults.strikes(Fault.STALE_ACK):
            older = (request - 2) % 0xFFFF + 1
            yield Reply(_ack(Status.SUCCESS, Command.READ_ACK, older, bytes(4)))
        delay_ms = 0
        if self._faults.strikes(Fault.PENDING_ACK):
            delay_ms = PENDING_TAKES_MS
            asked = PENDING.pack(0, PENDING_MS)
            yield Reply(_ack(Status.SUCCESS, Command.PENDING_ACK, request, asked))
        yield Reply(ack, delay_ms)


def _ack(status: Status, code: int, request: int, payload: bytes) -> bytes:
    return HEADER.pack(CONTROL_PREFIX, status, code & 0xFFFF, len(payload), request) + payload
