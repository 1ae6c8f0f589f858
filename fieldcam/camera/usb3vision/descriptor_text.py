"""USB descriptors as lines for somebody who writes a driver. Pure.

Field names and layouts are those of the USB 3.2 specification, chapter 9; of kinds that
are not known the bytes are given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from fieldcam.words import number_of

DEVICE, CONFIGURATION, INTERFACE, ENDPOINT, BOS = 1, 2, 4, 5, 15
_CAPABILITY, _ASSOCIATION, _COMPANION = 16, 11, 48
_TRANSFERS = ("control", "isochronous", "bulk", "interrupt")
_INTERFACE_CLASS_OFFSET = 5


def split_descriptors(raw: bytes) -> Iterator[bytes]:
    """Each descriptor, which begins with its own length; a broken rest as one more."""
    while raw:
        length = raw[0] if 2 <= raw[0] <= len(raw) else len(raw)
        yield raw[:length]
        raw = raw[length:]


def interface_classes(raw: bytes) -> frozenset[int]:
    """The class numbers of all interfaces."""
    return frozenset(
        each[_INTERFACE_CLASS_OFFSET]
        for each in split_descriptors(raw)
        if len(each) >= 9 and each[1] == INTERFACE
    )


def describe_descriptors(raw: bytes) -> Iterator[str]:
    """One line for each descriptor, those of an interface below it."""
    for each in split_descriptors(raw):
        layout = _LAYOUTS.get(each[1]) if len(each) > 1 else None
        if layout is None or len(each) < layout.least_bytes:
            kind = f"descriptor {each[1]:02x}" if len(each) > 1 else "rest"
            yield f"    {kind}: {each.hex(' ')}"
        else:
            yield layout.describe(each)


def _u16(raw: bytes, offset: int) -> int:
    return int.from_bytes(raw[offset : offset + 2], "little")


def _kind(raw: bytes, offset: int) -> str:
    """Class, subclass and protocol."""
    return "/".join(f"{byte:02x}" for byte in raw[offset : offset + 3])


def _version(raw: bytes, offset: int) -> str:
    """Of two bytes in binary-coded decimals."""
    return f"{raw[offset + 1]:x}.{raw[offset]:02x}"


def _device(raw: bytes) -> str:
    return (
        f"device {_u16(raw, 8):04x}:{_u16(raw, 10):04x} version {_version(raw, 12)}, "
        f"USB {_version(raw, 2)}, class {_kind(raw, 4)}, bMaxPacketSize0 {raw[7]}"
    )


def _configuration(raw: bytes) -> str:
    return (
        f"configuration {raw[5]}: {number_of(raw[4], 'interface')}, {_u16(raw, 2)} bytes, "
        f"bmAttributes {raw[7]:02x}, bMaxPower {raw[8]}"
    )


def _association(raw: bytes) -> str:
    return (
        f"  association of {number_of(raw[3], 'interface')} from {raw[2]} on, class {_kind(raw, 4)}"
    )


def _interface(raw: bytes) -> str:
    return f"  interface {raw[2]}.{raw[3]}: class {_kind(raw, 5)}, {number_of(raw[4], 'endpoint')}"


def _endpoint(raw: bytes) -> str:
    direction = "IN" if raw[2] & 0x80 else "OUT"
    return (
        f"    endpoint {raw[2]:02x} {direction}: {_TRANSFERS[raw[3] & 3]}, "
        f"wMaxPacketSize {_u16(raw, 4)}, bInterval {raw[6]}"
    )


def _companion(raw: bytes) -> str:
    return f"      companion: bMaxBurst {raw[2]}, bmAttributes {raw[3]:02x}"


def _store(raw: bytes) -> str:
    return f"binary object store: {raw[4]} capabilities"


def _capability(raw: bytes) -> str:
    return f"  capability {raw[2]:02x}: {raw.hex(' ')}"


@dataclass(frozen=True, slots=True)
class _Layout:
    """How long a descriptor of one kind is at least, and what it says."""

    least_bytes: int
    describe: Callable[[bytes], str]


_LAYOUTS = {
    DEVICE: _Layout(18, _device),
    CONFIGURATION: _Layout(9, _configuration),
    INTERFACE: _Layout(9, _interface),
    ENDPOINT: _Layout(7, _endpoint),
    _ASSOCIATION: _Layout(8, _association),
    BOS: _Layout(5, _store),
    _CAPABILITY: _Layout(3, _capability),
    _COMPANION: _Layout(6, _companion),
}
