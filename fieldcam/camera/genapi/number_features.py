"""The number features: integers and floats with range, increment and unit."""

from __future__ import annotations

import math
from abc import abstractmethod

from fieldcam.camera.genapi.arithmetic import Number, nearest_int
from fieldcam.camera.genapi.feature import Numeric, listed
from fieldcam.camera.genapi.visits import SETTING


class IntegerFeature(Numeric):
    """A whole number of 64 bits."""

    @property
    def value(self) -> int:
        self._require_readable()
        return self._answer("value", self._read)

    @value.setter
    def value(self, value: int) -> None:
        self._require_writable()
        with self._visit(SETTING):
            self._check(value)
            self._write(value)

    @property
    def min(self) -> int:
        return self._answer("min", self._lowest)

    @property
    def max(self) -> int:
        return self._answer("max", self._highest)

    @property
    def increment(self) -> int:
        """Allowed values are `min` and whole numbers of these above it."""
        return self._answer("increment", self._increment)

    @property
    def valid_values(self) -> tuple[int, ...]:
        """The only values allowed; empty where range and increment say all."""
        return ()

    @property
    def unit(self) -> str:
        return self._element.words("Unit")

    def number(self) -> int:
        return self.value

    def assign(self, value: Number) -> None:
        self.value = self._whole(value)

    def bounds(self) -> tuple[int, int]:
        return self.min, self.max

    def step(self) -> int:
        return self.increment

    @abstractmethod
    def _read(self) -> int: ...

    @abstractmethod
    def _write(self, value: int) -> None: ...

    @abstractmethod
    def _bounds(self) -> tuple[int, int]: ...

    def _lowest(self) -> int:
        return self._bounds()[0]

    def _highest(self) -> int:
        return self._bounds()[1]

    def _increment(self) -> int:
        return 1

    def _whole(self, value: Number) -> int:
        try:
            return nearest_int(value)
        except ArithmeticError as error:
            raise self._refuse(value, "whole numbers of 64 bits") from error

    def _check(self, value: int) -> None:
        if not isinstance(value, int) or isinstance(value, bool):
            raise self._refuse(value, "whole numbers")
        if self.valid_values and value not in self.valid_values:
            raise self._refuse(value, listed(self.valid_values))
        lowest, highest, increment = self.min, self.max, self.increment
        off_step = increment > 1 and (value - lowest) % increment
        if not lowest <= value <= highest or off_step:
            steps = f" in steps of {increment}" if increment > 1 else ""
            raise self._refuse(value, f"{lowest} to {highest}{steps}{_spaced(self.unit)}")


class FloatFeature(Numeric):
    """A finite number."""

    @property
    def value(self) -> float:
        self._require_readable()
        return self._answer("value", self._read)

    @value.setter
    def value(self, value: float) -> None:
        self._require_writable()
        with self._visit(SETTING):
            self._check(value)
            self._write(float(value))

    @property
    def min(self) -> float:
        return self._answer("min", self._lowest)

    @property
    def max(self) -> float:
        return self._answer("max", self._highest)

    @property
    def increment(self) -> float | None:
        """What the camera rounds to, where it says so; in-between values are not refused."""
        return self._answer("increment", self._increment)

    @property
    def unit(self) -> str:
        return self._element.words("Unit")

    def number(self) -> float:
        return self.value

    def assign(self, value: Number) -> None:
        self.value = float(value)

    def bounds(self) -> tuple[float, float]:
        return self.min, self.max

    def step(self) -> float | None:
        return self.increment

    @abstractmethod
    def _read(self) -> float: ...

    @abstractmethod
    def _write(self, value: float) -> None: ...

    @abstractmethod
    def _bounds(self) -> tuple[float, float]: ...

    def _lowest(self) -> float:
        return self._bounds()[0]

    def _highest(self) -> float:
        return self._bounds()[1]

    def _increment(self) -> float | None:
        return None

    def _check(self, value: float) -> None:
        if not isinstance(value, (int, float)) or not math.isfinite(value):
            raise self._refuse(value, "finite numbers")
        lowest, highest = self.min, self.max
        if not lowest <= value <= highest:
            raise self._refuse(value, f"{lowest:g} to {highest:g}{_spaced(self.unit)}")


def _spaced(unit: str) -> str:
    return f" {unit}" if unit else ""
