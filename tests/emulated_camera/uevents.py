"""Hotplug messages to the processes under umockdev's preload, in the form that udevd sends.

The header is that of libudev's monitor, which looks at the hashes of subsystem and
device type before anything else.
"""

from __future__ import annotations

import socket
import struct
from contextlib import suppress
from pathlib import Path

from .bus import Plugged
from .sysfs import device_path, properties

_MAGIC = 0xFEEDCAFE
_HEADER = struct.Struct("=8s4sIII4s4s8x")


def announce(root: Path, plugged: Plugged, came: bool, number: int) -> None:
    """Tell every listener below `root`; `number` counts the messages."""
    message = _message(plugged, "add" if came else "remove", number)
    for path in root.glob("event[0-9]*"):
        with socket.socket(socket.AF_UNIX, socket.SOCK_RAW) as sender, suppress(OSError):
            # A listener that is gone leaves its socket behind.
            sender.sendto(message, str(path))


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
