"""Where the registers of the features lie."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from .features import Bits, Choice, Delivered, Derived, Feature, Text

BASE = 0x0200_0000
STRIDE = 8
"""Between the registers of one feature, one for each entry of its selector."""


@dataclass(frozen=True, slots=True)
class Slot:
    """The registers of one feature."""

    address: int
    length: int
    count: int


def laid_out(features: Iterable[Feature]) -> Mapping[str, Slot]:
    """A slot for each feature that has registers of its own, from BASE on."""
    features = tuple(features)
    entries = {f.name: len(f.entries) for f in features if isinstance(f, Choice)}
    slots: dict[str, Slot] = {}
    address = BASE
    for feature in features:
        if isinstance(feature, Text | Bits | Derived | Delivered):
            continue
        count = entries[feature.selector] if feature.selector else 1
        slots[feature.name] = Slot(address, feature.length, count)
        address += STRIDE * count
    return slots


def end_of(slots: Mapping[str, Slot]) -> int:
    """The first address behind all of them."""
    return max(slot.address + STRIDE * slot.count for slot in slots.values())
