"""The features' registers, filled with their defaults and guarded as the XML says."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

from .features import Choice, Feature, Integer, Lock, Real, Scaled, Switch
from .layout import BASE, STRIDE, end_of, laid_out
from .protocol import Status
from .registers import Access, AddressSpace, Refused, Register

Snapshot = Mapping[str, tuple[bytes, ...]]


class Settings:
    """Reads and writes features by name, as the camera's own firmware does."""

    def __init__(self, features: tuple[Feature, ...], space: AddressSpace) -> None:
        self.features = features
        self.slots = laid_out(features)
        self._by_name = {feature.name: feature for feature in features}
        self._registers: dict[str, tuple[Register, ...]] = {}
        block = space.add(BASE, end_of(self.slots) - BASE)
        for name, slot in self.slots.items():
            feature = self._by_name[name]
            self._registers[name] = tuple(
                block.add(self._register(feature, slot.address + STRIDE * index))
                for index in range(slot.count)
            )

    def register(self, name: str, index: int = 0) -> Register:
        return self._registers[name][index]

    def integer(self, name: str, index: int = 0) -> int:
        return self.register(name, index).integer

    def real(self, name: str, index: int = 0) -> float:
        """Of a float feature, in its unit."""
        feature, register = self._by_name[name], self.register(name, index)
        if not isinstance(feature, Scaled):
            return register.real
        raw = int.from_bytes(register.data, "little", signed=feature.signed)
        return raw / feature.per_unit

    def chosen(self, name: str, index: int = 0) -> str:
        """The entry of an enumeration."""
        feature = self._by_name[name]
        assert isinstance(feature, Choice)
        value = self.integer(name, index)
        return next(entry for entry, number in feature.entries.items() if number == value)

    def on_write(self, name: str, act: Callable[[], None]) -> None:
        """Do this whenever a host has written any of the feature's registers."""
        for register in self._registers[name]:
            register.written = act

    def snapshot(self) -> Snapshot:
        """All that a host may set."""
        return {
            name: tuple(bytes(r.data) for r in registers)
            for name, registers in self._registers.items()
            if self._by_name[name].access is Access.RW
        }

    def restore(self, snapshot: Snapshot) -> None:
        for name, values in snapshot.items():
            for register, data in zip(self._registers[name], values, strict=True):
                register.data[:] = data

    def _register(self, feature: Feature, address: int) -> Register:
        data = bytearray(_initial(feature))
        return Register(address, data, feature.access, check=self._check(feature))

    def _check(self, feature: Feature) -> Callable[[bytes], None]:
        def check(data: bytes) -> None:
            if feature.available_by and not self.integer(feature.available_by):
                raise Refused(Status.ACCESS_DENIED)
            if feature.lock is Lock.WHILE_STREAMING and self.integer("TLParamsLocked"):
                raise Refused(Status.ACCESS_DENIED)
            if not self._allowed(feature, data):
                raise Refused(Status.INVALID_PARAMETER)

        return check

    def _allowed(self, feature: Feature, data: bytes) -> bool:
        number = int.from_bytes(data, "little")
        match feature:
            case Integer(minimum=low, maximum=high, increment=step):
                highest = high if isinstance(high, int) else self.integer(high)
                return low <= number <= highest and (number - low) % step == 0
            case Choice(entries=entries):
                return number in entries.values()
            case Real(minimum=least, maximum=most):
                (real,) = struct.unpack("<d", data)
                return bool(least <= real <= most)
            case Scaled(minimum=least, maximum=most, per_unit=unit):
                return least <= number / unit <= most
        return True


def _initial(feature: Feature) -> bytes:
    match feature:
        case Real(initial=real):
            return struct.pack("<d", real)
        case Scaled(initial=real, per_unit=unit):
            return round(real * unit).to_bytes(feature.length, "little", signed=feature.signed)
        case Integer(initial=number) | Choice(initial=number) | Switch(initial=number):
            return int(number).to_bytes(feature.length, "little")
    return bytes(feature.length)
