"""Bulk transfers: what the layers above need of a USB library.

A transfer that fails while the camera may still be there raises a TransferFault;
CameraUnplugged and UsbMemoryShort are for good.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fieldcam.errors import DeviceError

Bytes = npt.NDArray[np.uint8]
"""(n,) uint8, contiguous: memory that a transfer may fill."""

MAX_PACKET_BYTES = 1024
"""Of a bulk endpoint at SuperSpeed; twice that of High Speed. A read whose length is a
multiple of it cannot end inside a packet (libusb would call that an overflow)."""


class LinkSpeed(IntEnum):
    """Bus speed in libusb's order."""

    UNKNOWN = 0
    LOW = 1
    FULL = 2
    HIGH = 3
    SUPER = 4
    SUPER_PLUS = 5

    @property
    def is_usb3(self) -> bool:
        return self >= LinkSpeed.SUPER


class TransferFault(DeviceError):
    """One transfer failed; the camera may still be there."""


class TransferTimeout(TransferFault):
    """Not one byte came, or went, in time."""


class EndpointStalled(TransferFault):
    """The camera halted the endpoint; it moves nothing until the halt is cleared."""


class TransferOverflow(TransferFault):
    """The camera sent more than was asked for (babble)."""


class LinkFault(TransferFault):
    """The bus reported an error: a bad cable, or the first sign of an unplugged camera."""


class BulkOut(Protocol):
    """An endpoint that takes bytes."""

    def write(self, data: bytes, timeout_s: float) -> None:
        """Send one whole transfer."""
        ...

    def clear_halt(self) -> None:
        """Let the endpoint go on after a stall."""
        ...


class BulkIn(Protocol):
    """An endpoint that gives bytes; one thread at a time reads it."""

    def read(self, into: Bytes, timeout_s: float) -> int:
        """Fill `into` (N,) from one transfer and give how many bytes came.

        Fewer than asked for where the camera ended the transfer early, and where the
        time ran out after the first byte; TransferTimeout where nothing came at all.
        """
        ...

    def halt(self) -> None:
        """Ask the camera to halt the endpoint (SET_FEATURE ENDPOINT_HALT)."""
        ...

    def clear_halt(self) -> None:
        """Let the endpoint go on after a stall."""
        ...


def round_up(length: int, unit: int) -> int:
    """The smallest multiple of `unit` that is not below `length`."""
    return -(-length // unit) * unit
