"""A USB device as a host controller sees it: endpoint 0 and bulk endpoints."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

from . import descriptors
from .descriptors import STREAM_IN, Identity, Speed
from .faults import Faults
from .pipes import InPipe

_TO_ENDPOINT = 0x02


class Request(IntEnum):
    """Standard requests."""

    GET_STATUS = 0
    CLEAR_FEATURE = 1
    SET_FEATURE = 3
    GET_DESCRIPTOR = 6
    GET_CONFIGURATION = 8
    SET_CONFIGURATION = 9
    SET_INTERFACE = 11


class Stalled(Exception):
    """The device does not know this request."""


@dataclass(frozen=True, slots=True)
class Setup:
    """The first eight bytes of a control transfer."""

    request_type: int
    request: int
    value: int
    index: int
    length: int

    @classmethod
    def parse(cls, data: bytes) -> Setup:
        return cls(*struct.unpack("<BBHHH", data[:8]))


class UsbFunction(Protocol):
    """What a device does beside being one; every call is made under the bus's lock."""

    identity: Identity
    faults: Faults
    pipes: dict[int, InPipe]

    def powered(self, speed: Speed, now_ns: int) -> None:
        """It was plugged in and starts from nothing."""
        ...

    def received(self, endpoint: int, data: bytes, now_ns: int) -> None:
        """A bulk OUT transfer came."""
        ...

    def poll(self, now_ns: int) -> None:
        """Do all that is due by now."""
        ...


def control(function: UsbFunction, speed: Speed, setup: Setup) -> bytes:
    """Answer a standard request; raises Stalled."""
    match setup.request:
        case Request.GET_DESCRIPTOR:
            return _descriptor(function.identity, speed, setup)[: setup.length]
        case Request.GET_CONFIGURATION:
            return b"\x01"
        case Request.GET_STATUS:
            return _status(function, setup)
        case Request.SET_CONFIGURATION | Request.SET_INTERFACE:
            return b""
        case Request.CLEAR_FEATURE | Request.SET_FEATURE if _to_endpoint(setup):
            _set_halt(function, setup.index, setup.request == Request.SET_FEATURE)
            return b""
    raise Stalled


def clear_halt(function: UsbFunction, endpoint: int) -> None:
    """End a stall; what the host had not taken of a stream is gone."""
    _set_halt(function, endpoint, False)


def _set_halt(function: UsbFunction, endpoint: int, halted: bool) -> None:
    pipe = function.pipes.get(endpoint)
    if pipe is None:
        return
    if endpoint == STREAM_IN and (halted or pipe.halted):
        pipe.clear()
    pipe.halted = halted


def _status(function: UsbFunction, setup: Setup) -> bytes:
    pipe = function.pipes.get(setup.index)
    return struct.pack("<H", int(_to_endpoint(setup) and pipe is not None and pipe.halted))


def _to_endpoint(setup: Setup) -> bool:
    return setup.request_type & 0x1F == _TO_ENDPOINT


def _descriptor(identity: Identity, speed: Speed, setup: Setup) -> bytes:
    kind, index = setup.value >> 8, setup.value & 0xFF
    found = {
        descriptors.DEVICE: lambda: descriptors.device(identity, speed),
        descriptors.CONFIGURATION: lambda: descriptors.configuration(identity, speed),
        descriptors.STRING: lambda: descriptors.string(identity, index),
        descriptors.BOS: descriptors.binary_object_store,
    }.get(kind, lambda: None)()
    if found is None:
        raise Stalled
    return found
