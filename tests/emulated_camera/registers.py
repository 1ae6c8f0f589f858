"""A camera's registers, and by which rules a host may read and write them."""

from __future__ import annotations

import struct
from bisect import bisect_right, insort
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from .protocol import Status

TEXT_LENGTH = 64
"""Of every string register, in bytes."""


class Refused(Exception):
    """A register says no; carries the status of the ack."""

    def __init__(self, status: Status) -> None:
        super().__init__(status.name)
        self.status = status


class Access(Enum):
    """What a host may do with a register."""

    RO = "RO"
    RW = "RW"
    WO = "WO"


@dataclass(slots=True, eq=False)
class Register:
    """One register; what it holds is kept as the bytes on the wire."""

    address: int
    data: bytearray
    access: Access = Access.RO
    refresh: Callable[[], None] | None = None
    """Called before the host reads."""
    check: Callable[[bytes], None] | None = None
    """Called before what a host writes is taken over; raises Refused."""
    written: Callable[[], None] | None = None
    """Called after the host has written."""

    @property
    def integer(self) -> int:
        return int.from_bytes(self.data, "little")

    @integer.setter
    def integer(self, value: int) -> None:
        self.data[:] = value.to_bytes(len(self.data), "little")

    @property
    def real(self) -> float:
        """Of an eight-byte register."""
        value: float = struct.unpack("<d", self.data)[0]
        return value

    @real.setter
    def real(self, value: float) -> None:
        self.data[:] = struct.pack("<d", value)

    @property
    def text(self) -> str:
        return bytes(self.data).partition(b"\0")[0].decode()

    @text.setter
    def text(self, value: str) -> None:
        self.data[:] = value.encode().ljust(len(self.data), b"\0")


@dataclass(slots=True, eq=False)
class Block:
    """A stretch of addresses; what no register covers reads as zero."""

    base: int
    length: int
    alignment: int
    """Of addresses and counts, in bytes."""
    registers: list[Register] = field(default_factory=list)

    def add(self, register: Register) -> Register:
        insort(self.registers, register, key=lambda r: r.address)
        return register

    def covers(self, address: int, count: int) -> bool:
        return self.base <= address and address + count <= self.base + self.length

    def read(self, address: int, count: int) -> bytes:
        self._check_alignment(address, count)
        found = bytearray(count)
        first = max(0, bisect_right(self.registers, address, key=lambda r: r.address) - 1)
        for register in self.registers[first:]:
            if register.address >= address + count:
                break
            _copy(register, address, found)
        return bytes(found)

    def write(self, address: int, data: bytes) -> None:
        """Whole registers, one after the other; a text may be cut short."""
        self._check_alignment(address, len(data))
        while data:
            register = self._at(address)
            piece, data = data[: len(register.data)], data[len(register.data) :]
            address += len(piece)
            _write(register, piece)

    def _at(self, address: int) -> Register:
        index = bisect_right(self.registers, address, key=lambda r: r.address) - 1
        if index < 0 or self.registers[index].address != address:
            raise Refused(Status.WRITE_PROTECT)
        return self.registers[index]

    def _check_alignment(self, address: int, count: int) -> None:
        if address % self.alignment or count % self.alignment:
            raise Refused(Status.BAD_ALIGNMENT)


class AddressSpace:
    """All blocks of a camera."""

    def __init__(self) -> None:
        self._blocks: list[Block] = []

    def add(self, base: int, length: int, alignment: int = 4) -> Block:
        block = Block(base, length, alignment)
        self._blocks.append(block)
        return block

    def read(self, address: int, count: int) -> bytes:
        """Raises Refused."""
        return self._block(address, count).read(address, count)

    def write(self, address: int, data: bytes) -> None:
        """Raises Refused."""
        self._block(address, len(data)).write(address, data)

    def _block(self, address: int, count: int) -> Block:
        for block in self._blocks:
            if block.covers(address, count):
                return block
        raise Refused(Status.INVALID_ADDRESS)


def _copy(register: Register, address: int, into: bytearray) -> None:
    """The part of a register that lies in `into`, which begins at `address`."""
    start, end = register.address, register.address + len(register.data)
    low, high = max(start, address), min(end, address + len(into))
    if low >= high:
        return
    if register.refresh:
        register.refresh()
    if register.access is not Access.WO:
        into[low - address : high - address] = register.data[low - start : high - start]


def _write(register: Register, data: bytes) -> None:
    if register.access is Access.RO:
        raise Refused(Status.WRITE_PROTECT)
    if len(data) != len(register.data) != TEXT_LENGTH:
        raise Refused(Status.INVALID_PARAMETER)
    if register.check:
        register.check(data)
    register.data[:] = data.ljust(len(register.data), b"\0")
    if register.written:
        register.written()
