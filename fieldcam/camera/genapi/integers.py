"""Integer nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from fieldcam.camera.genapi.access import Access
from fieldcam.camera.genapi.arithmetic import HIGHEST_INT, LOWEST_INT, wrap
from fieldcam.camera.genapi.conversion import Conversion
from fieldcam.camera.genapi.elements import Element, whole_number
from fieldcam.camera.genapi.feature import Feature, Scope
from fieldcam.camera.genapi.formula import WHOLE
from fieldcam.camera.genapi.in_register import InRegister
from fieldcam.camera.genapi.number_features import IntegerFeature
from fieldcam.camera.genapi.sources import ValueSource, number_of
from fieldcam.camera.genapi.variables import FormulaSource
from fieldcam.errors import FeatureFileInvalid

LONGEST_INTEGER_BYTES = 8

Order = Literal["big", "little"]


class Integer(IntegerFeature):
    """A number that the file holds, or that another node carries."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._source = ValueSource(element, scope, self.name)

    @property
    def valid_values(self) -> tuple[int, ...]:
        parts = self._element.words("ValidValueSet").split(";")
        return tuple(
            whole_number(Element("ValidValueSet", {}, text=part.strip()))
            for part in parts
            if part.strip()
        )

    def _carriers(self) -> Sequence[Feature]:
        return self._source.carriers()

    def _declared_carriers(self) -> Sequence[Feature]:
        return self._source.declared_carriers()

    def _read(self) -> int:
        return self._whole(self._source.number())

    def _write(self, value: int) -> None:
        self._source.assign(value)

    def _lowest(self) -> int:
        return self._whole(self._source.lowest(LOWEST_INT))

    def _highest(self) -> int:
        return self._whole(self._source.highest(HIGHEST_INT))

    def _bounds(self) -> tuple[int, int]:
        return self._lowest(), self._highest()

    def _increment(self) -> int:
        found = number_of(self._element, "Inc", self._scope, self.name)
        if found is None:
            found = self._source.step()
        return 1 if found is None else max(1, self._whole(found))


class IntReg(InRegister, IntegerFeature):
    """A whole register."""

    def _read(self) -> int:
        return wrap(int.from_bytes(self._data(), self._order, signed=self._stretch.signed))

    def _write(self, value: int) -> None:
        length = self._length()
        self._stretch.write((value % 2 ** (8 * length)).to_bytes(length, self._order))

    def _bounds(self) -> tuple[int, int]:
        return _bounds_of_bits(8 * self._length(), self._stretch.signed)

    @property
    def _order(self) -> Order:
        return "big" if self._stretch.big_endian else "little"

    def _data(self) -> bytes:
        self._length()
        return self._stretch.read()

    def _length(self) -> int:
        length = self._stretch.length
        if length > LONGEST_INTEGER_BYTES:
            raise FeatureFileInvalid(
                f"The camera's feature file gives the integer {self.name} {length} bytes."
            )
        return length


class MaskedIntReg(IntReg):
    """Some bits of a register; in a big-endian one, bit 0 is the highest."""

    def _read(self) -> int:
        shift, bits = self._field()
        found = int.from_bytes(self._data(), self._order) >> shift & 2**bits - 1
        negative = self._stretch.signed and found >> bits - 1
        return wrap(found - 2**bits if negative else found)

    def _write(self, value: int) -> None:
        shift, bits = self._field()
        mask = 2**bits - 1 << shift
        others = int.from_bytes(self._kept(), self._order) & ~mask
        word = others | value << shift & mask
        self._stretch.write(word.to_bytes(self._length(), self._order))

    def _bounds(self) -> tuple[int, int]:
        return _bounds_of_bits(self._field()[1], self._stretch.signed)

    def _kept(self) -> bytes:
        """The register's other bits; nobody can tell those of one that is only written."""
        return self._data() if self._stretch.declared_access.readable else bytes(self._length())

    def _field(self) -> tuple[int, int]:
        """Place of the lowest bit above the register's lowest, and the number of bits."""
        first, last = sorted(self._bit(tag) for tag in ("LSB", "MSB"))
        register_bits = 8 * self._length()
        if not 0 <= first <= last < register_bits:
            raise FeatureFileInvalid(
                f"The camera's feature file gives {self.name} bits {first} to {last} "
                f"of a register of {register_bits}."
            )
        shift = register_bits - 1 - last if self._stretch.big_endian else first
        return shift, last - first + 1

    def _bit(self, tag: str) -> int:
        child = self._element.first("Bit", tag)
        if child is None:
            raise FeatureFileInvalid(f"The camera's feature file gives {self.name} no {tag}.")
        return whole_number(child)


class IntSwissKnife(IntegerFeature):
    """What a formula makes of other nodes."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._source = FormulaSource(element, scope, self.name, WHOLE)

    def _own_access(self) -> Access:
        return Access.READ_ONLY

    def _feeders(self) -> Sequence[Feature]:
        return self._source.variables.nodes()

    def _read(self) -> int:
        return self._whole(self._source.number("Formula", {}))

    def _write(self, value: int) -> None:
        raise AssertionError("a formula's result is never writable")

    def _bounds(self) -> tuple[int, int]:
        return LOWEST_INT, HIGHEST_INT


class IntConverter(IntegerFeature):
    """Another node's number, seen through a formula."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._conversion = Conversion(element, scope, self.name, WHOLE)

    def _carriers(self) -> Sequence[Feature]:
        return (self._conversion.carrier,)

    def _feeders(self) -> Sequence[Feature]:
        return self._conversion.feeders()

    def _read(self) -> int:
        return self._whole(self._conversion.number())

    def _write(self, value: int) -> None:
        self._conversion.assign(value)

    def _bounds(self) -> tuple[int, int]:
        lowest, highest = self._conversion.bounds(LOWEST_INT, HIGHEST_INT)
        return self._whole(lowest), self._whole(highest)


def _bounds_of_bits(bits: int, signed: bool) -> tuple[int, int]:
    if signed:
        return -(2 ** (bits - 1)), 2 ** (bits - 1) - 1
    return 0, min(2**bits - 1, HIGHEST_INT)
