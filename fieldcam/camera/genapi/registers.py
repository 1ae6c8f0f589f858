"""Where a node map reads and writes, and what it remembers of it."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from fieldcam.errors import CameraUnplugged


class Registers(Protocol):
    """A device's address space, as its control channel gives it.

    Both methods raise a DeviceError when the device does not answer or refuses.
    """

    def read(self, address: int, length: int) -> bytes:
        """Exactly `length` bytes."""
        ...

    def write(self, address: int, data: bytes) -> None: ...


class NotConnected(CameraUnplugged):
    """Only a camera could tell, and there is none behind the feature file."""

    def __init__(self) -> None:
        super().__init__("Only the camera can tell, and none is connected.", "Plug it in.")


class NoCamera:
    """Stands in for the registers where only the feature file is at hand."""

    def read(self, address: int, length: int) -> bytes:
        raise NotConnected

    def write(self, address: int, data: bytes) -> None:
        raise NotConnected


class Caching(StrEnum):
    """What may be remembered of a register."""

    NO_CACHE = "NoCache"
    """Nothing: every read asks the camera."""
    WRITE_THROUGH = "WriteThrough"
    """What was read, and what was written."""
    WRITE_AROUND = "WriteAround"
    """What was read; a write is followed by a fresh read."""


@dataclass(frozen=True, slots=True)
class RegisterRange:
    """A stretch of one port's address space, cached in one way."""

    port: str
    address: int
    length: int
    caching: Caching

    def overlaps(self, other: RegisterRange) -> bool:
        return (
            self.port == other.port
            and self.address < other.address + other.length
            and other.address < self.address + self.length
        )


@dataclass(frozen=True, slots=True)
class _Remembered:
    data: bytes
    read_at_s: float


class RegisterCache:
    """What was read, by place, and which nodes read it.

    Nodes that share a place share its entry: a camera often keeps dozens of flags
    in one register.
    """

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._clock_s = clock_s
        self._entries: dict[RegisterRange, _Remembered] = {}
        self._read_by: defaultdict[str, set[RegisterRange]] = defaultdict(set)

    def find(self, node: str, place: RegisterRange, polling_s: float | None) -> bytes | None:
        """What is remembered of `place`, unless older than the node's polling time."""
        entry = self._entries.get(place)
        if entry is None:
            return None
        if polling_s is not None and self._clock_s() - entry.read_at_s >= polling_s:
            return None
        self._read_by[node].add(place)
        return entry.data

    def remember(self, node: str, place: RegisterRange, data: bytes) -> None:
        if place.caching is not Caching.NO_CACHE:
            self._entries[place] = _Remembered(data, self._clock_s())
            self._read_by[node].add(place)

    def forget_place(self, place: RegisterRange) -> None:
        """Drop whatever overlaps it, whichever node read it."""
        for other in [other for other in self._entries if other.overlaps(place)]:
            del self._entries[other]

    def forget_nodes(self, nodes: Iterable[str]) -> None:
        """Drop what these nodes read."""
        for node in nodes:
            for place in self._read_by.pop(node, ()):
                self._entries.pop(place, None)

    def clear(self) -> None:
        """Drop everything."""
        self._entries.clear()
        self._read_by.clear()
