"""Hotplug messages to the processes under umockdev's preload, in the form that udevd sends.

The header is that of libudev's monitor, which looks at the hashes of subsystem and
device type before anything else.
"""

from __future__ import annotations

import os
import socket
import struct
from contextlib import suppress
from pathlib import Path

from .bus import Plugged
from .sysfs import device_path, properties

_MAGIC = 0xFEEDCAFE
_HEADER = struct.Struct("=8s4sIII4s4s8x")


class Listeners:
    """The sockets at which processes wait for messages; used by one thread at a time.

    The preload names a socket by its number in its process, so that one process takes
    the name from another that has the same number. A second name keeps it reachable.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._kept = root / "listeners"
        self._kept.mkdir()

    def look(self) -> None:
        """Remember who has begun to listen; to be called again and again."""
        for path in self._root.glob("event[0-9]*"):
            # A name that another process takes just now is there again in a moment.
            with suppress(FileExistsError, FileNotFoundError):
                os.link(path, self._kept / str(path.stat().st_ino))

    def announce(self, plugged: Plugged, came: bool, number: int) -> None:
        """Tell every listener; `number` counts the messages."""
        self.look()
        message = _message(plugged, "add" if came else "remove", number)
        with socket.socket(socket.AF_UNIX, socket.SOCK_RAW) as sender:
            sender.setblocking(False)
            for path in self._kept.iterdir():
                try:
                    sender.sendto(message, str(path))
                except ConnectionRefusedError:
                    path.unlink()  # its process has ended
                except BlockingIOError:
                    """It was stopped, and a real kernel would drop the message too."""


def _message(plugged: Plugged, action: str, number: int) -> bytes:
    values = {
        "ACTION": action,
        "DEVPATH": device_path(plugged),
        "SUBSYSTEM": "usb",
        "SEQNUM": str(number),
        **properties(plugged),
        "DEVNAME": f"/dev/{properties(plugged)['DEVNAME']}",
    }
    body = b"".join(f"{key}={value}".encode() + b"\0" for key, value in values.items())
    hashes = [murmur_hash(text).to_bytes(4, "big") for text in (b"usb", b"usb_device")]
    magic = _MAGIC.to_bytes(4, "big")
    size = _HEADER.size
    return _HEADER.pack(b"libudev\0", magic, size, size, len(body), *hashes) + body


def murmur_hash(text: bytes) -> int:
    """MurmurHash2 by Austin Appleby (public domain), 32 bit, seed 0."""
    factor, mask = 0x5BD1E995, 0xFFFFFFFF
    found = len(text)
    whole = len(text) - len(text) % 4
    for (word,) in struct.iter_unpack("<I", text[:whole]):
        word = word * factor & mask
        word = (word ^ word >> 24) * factor & mask
        found = (found * factor & mask) ^ word
    if rest := text[whole:]:
        found = (found ^ int.from_bytes(rest, "little")) * factor & mask
    found = (found ^ found >> 13) * factor & mask
    return found ^ found >> 15
