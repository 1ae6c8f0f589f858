"""Float nodes."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from fieldcam.camera.genapi.access import Access
from fieldcam.camera.genapi.conversion import Conversion
from fieldcam.camera.genapi.elements import LARGEST_FLOAT, Element
from fieldcam.camera.genapi.feature import Feature, Scope
from fieldcam.camera.genapi.formula import REAL
from fieldcam.camera.genapi.in_register import InRegister
from fieldcam.camera.genapi.number_features import FloatFeature
from fieldcam.camera.genapi.sources import ValueSource, number_of
from fieldcam.camera.genapi.variables import FormulaSource
from fieldcam.errors import FeatureFileInvalid

LAYOUTS = {4: "f", 8: "d"}
"""IEEE 754, by the register's bytes."""
LARGEST_SINGLE = float(2**128 - 2**104)


class Float(FloatFeature):
    """A number that the file holds, or that another node carries."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._source = ValueSource(element, scope, self.name)

    def _carriers(self) -> Sequence[Feature]:
        return self._source.carriers()

    def _declared_carriers(self) -> Sequence[Feature]:
        return self._source.declared_carriers()

    def _read(self) -> float:
        return float(self._source.number())

    def _write(self, value: float) -> None:
        self._source.assign(value)

    def _lowest(self) -> float:
        return float(self._source.lowest(-LARGEST_FLOAT))

    def _highest(self) -> float:
        return float(self._source.highest(LARGEST_FLOAT))

    def _bounds(self) -> tuple[float, float]:
        return self._lowest(), self._highest()

    def _increment(self) -> float | None:
        found = number_of(self._element, "Inc", self._scope, self.name)
        if found is None:
            found = self._source.step()
        return None if found is None else float(found)


class FloatReg(InRegister, FloatFeature):
    """A register that holds an IEEE 754 float."""

    def _read(self) -> float:
        layout = self._layout()
        return float(struct.unpack(layout, self._stretch.read())[0])

    def _write(self, value: float) -> None:
        self._stretch.write(struct.pack(self._layout(), value))

    def _bounds(self) -> tuple[float, float]:
        largest = LARGEST_SINGLE if self._layout().endswith("f") else LARGEST_FLOAT
        return -largest, largest

    def _layout(self) -> str:
        length = self._stretch.length
        if length not in LAYOUTS:
            raise FeatureFileInvalid(
                f"The camera's feature file gives the float {self.name} {length} bytes."
            )
        return (">" if self._stretch.big_endian else "<") + LAYOUTS[length]


class SwissKnife(FloatFeature):
    """What a formula makes of other nodes."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._source = FormulaSource(element, scope, self.name, REAL)

    def _own_access(self) -> Access:
        return Access.READ_ONLY

    def _feeders(self) -> Sequence[Feature]:
        return self._source.variables.nodes()

    def _read(self) -> float:
        return float(self._source.number("Formula", {}))

    def _write(self, value: float) -> None:
        raise AssertionError("a formula's result is never writable")

    def _bounds(self) -> tuple[float, float]:
        return -LARGEST_FLOAT, LARGEST_FLOAT


class Converter(FloatFeature):
    """Another node's number, seen through a formula."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._conversion = Conversion(element, scope, self.name, REAL)

    def _carriers(self) -> Sequence[Feature]:
        return (self._conversion.carrier,)

    def _feeders(self) -> Sequence[Feature]:
        return self._conversion.feeders()

    def _read(self) -> float:
        return float(self._conversion.number())

    def _write(self, value: float) -> None:
        self._conversion.assign(value)

    def _bounds(self) -> tuple[float, float]:
        lowest, highest = self._conversion.bounds(-LARGEST_FLOAT, LARGEST_FLOAT)
        return float(lowest), float(highest)
