"""All bootstrap registers one by one, for a report: what one refuses, the others still tell.

Names and offsets as in `bootstrap`, with those added that a driver does not need.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fieldcam.camera.genapi import Registers
from fieldcam.errors import CameraRefused

Layout = tuple[tuple[int, int, str], ...]
"""Offset, length in bytes, name of each register."""

_TEXT_BYTES = 64
ABRM: Layout = (
    (0x000, 4, "GenCP version"),
    (0x004, 64, "manufacturer name"),
    (0x044, 64, "model name"),
    (0x084, 64, "family name"),
    (0x0C4, 64, "device version"),
    (0x104, 64, "manufacturer info"),
    (0x144, 64, "serial number"),
    (0x184, 64, "user-defined name"),
    (0x1C4, 8, "device capability"),
    (0x1CC, 4, "maximum response time, ms"),
    (0x1D0, 8, "manifest table address"),
    (0x1D8, 8, "SBRM address"),
    (0x1E0, 8, "device configuration"),
    (0x1E8, 4, "heartbeat timeout, ms"),
    (0x1EC, 4, "message channel id"),
    (0x1F0, 8, "timestamp"),
    (0x1FC, 8, "timestamp increment"),
    (0x204, 4, "access privilege"),
    (0x208, 4, "protocol endianness"),
    (0x20C, 4, "implementation endianness"),
)
SBRM: Layout = (
    (0x00, 4, "U3V version"),
    (0x04, 8, "U3VCP capability"),
    (0x0C, 8, "U3VCP configuration"),
    (0x14, 4, "maximum command transfer length"),
    (0x18, 4, "maximum acknowledge transfer length"),
    (0x1C, 4, "number of stream channels"),
    (0x20, 8, "SIRM address"),
    (0x28, 4, "SIRM length"),
    (0x2C, 8, "EIRM address"),
    (0x34, 4, "EIRM length"),
    (0x38, 8, "IIDC2 address"),
    (0x40, 4, "current speed"),
)
SIRM: Layout = (
    (0x00, 4, "SI info"),
    (0x04, 4, "SI control"),
    (0x08, 8, "required payload size"),
    (0x10, 4, "required leader size"),
    (0x14, 4, "required trailer size"),
    (0x18, 4, "maximum leader size"),
    (0x1C, 4, "payload transfer size"),
    (0x20, 4, "payload transfer count"),
    (0x24, 4, "payload final transfer 1 size"),
    (0x28, 4, "payload final transfer 2 size"),
    (0x2C, 4, "maximum trailer size"),
)
EIRM: Layout = (
    (0x00, 4, "EI control"),
    (0x04, 4, "maximum event transfer length"),
    (0x08, 4, "event test control"),
)
BLOCKS = {"ABRM": ABRM, "SBRM": SBRM, "SIRM": SIRM, "EIRM": EIRM}
"""Each before those that its pointers lead to."""


@dataclass(frozen=True, slots=True)
class RegisterContent:
    """What one register holds."""

    block: str
    name: str
    address: int
    content: bytes
    """Empty where the camera refused it."""
    problem: str = ""

    @property
    def number(self) -> int:
        """Little-endian; 0 where the camera refused it."""
        return int.from_bytes(self.content, "little")

    @property
    def text(self) -> str:
        """As a person reads it."""
        if not self.content:
            return self.problem
        if len(self.content) == _TEXT_BYTES:
            return self.content.partition(b"\0")[0].decode("utf-8", "replace")
        return f"0x{self.number:0{2 * len(self.content)}x} = {self.number}"


def read_blocks(registers: Registers) -> Iterator[RegisterContent]:
    """ABRM, then SBRM, SIRM and EIRM where pointers lead to them.

    The timestamp's latch and all else that acts on a touch is left alone. Raises
    CameraSilent or CameraUnplugged where the camera goes in the middle.
    """
    pointers = {"ABRM address": 0}
    for block, layout in BLOCKS.items():
        base = pointers.get(f"{block} address")
        if base is None:
            continue
        for each in _read(registers, block, base, layout):
            if each.number:
                pointers.setdefault(each.name, each.number)
            yield each


def _read(registers: Registers, block: str, base: int, layout: Layout) -> Iterator[RegisterContent]:
    for offset, length, name in layout:
        address = base + offset
        try:
            yield RegisterContent(block, name, address, registers.read(address, length))
        except CameraRefused as error:
            yield RegisterContent(block, name, address, b"", error.message)
