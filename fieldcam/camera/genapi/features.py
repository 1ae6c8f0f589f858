"""What a program sees of a camera: its features, by kind; numbers are in `number_features`.

The classes here check and explain; how a value is come by is left to the node
types below them. A value is read from the camera whenever it is asked for, unless
the feature file allows to remember it.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator

from fieldcam.camera.genapi.arithmetic import Number
from fieldcam.camera.genapi.feature import Feature, Numeric, listed
from fieldcam.camera.genapi.visits import SETTING
from fieldcam.errors import FeatureRefused


class BooleanFeature(Numeric):
    """On or off."""

    @property
    def value(self) -> bool:
        self._require_readable()
        return self._answer("value", self._read)

    @value.setter
    def value(self, value: bool) -> None:
        self._require_writable()
        with self._visit(SETTING):
            if not isinstance(value, bool):
                raise self._refuse(value, "True and False")
            self._write(value)

    def number(self) -> int:
        return int(self.value)

    def assign(self, value: Number) -> None:
        self.value = bool(value)

    def bounds(self) -> tuple[int, int]:
        return 0, 1

    @abstractmethod
    def _read(self) -> bool: ...

    @abstractmethod
    def _write(self, value: bool) -> None: ...


class EnumEntry(Feature, ABC):
    """One choice of an enumeration."""

    @property
    def symbol(self) -> str:
        """What `EnumerationFeature.value` is when this one is chosen."""
        return self._element.words("Symbolic", self._element.name)

    @property
    def self_clearing(self) -> bool:
        """Whether the camera leaves this choice again by itself."""
        return self._element.words("IsSelfClearing") == "Yes"

    @property
    @abstractmethod
    def code(self) -> int:
        """The number that the camera knows it by."""

    @property
    @abstractmethod
    def numeric(self) -> Number:
        """What it stands for in a formula."""


class EnumerationFeature(Numeric):
    """A choice among named entries."""

    @property
    @abstractmethod
    def entries(self) -> tuple[EnumEntry, ...]:
        """All that the feature file declares, whether available or not."""

    @property
    def value(self) -> str:
        """The symbol of the entry that is chosen."""
        return self.chosen.symbol

    @value.setter
    def value(self, value: str) -> None:
        self._require_writable()
        with self._visit(SETTING):
            self._write(self._choose(value))

    @property
    def symbols(self) -> tuple[str, ...]:
        """What can be chosen now."""
        return tuple(entry.symbol for entry in self.entries if entry.available)

    @property
    def chosen(self) -> EnumEntry:
        self._require_readable()
        code = self._answer("value", self._read)
        for entry in self.entries:
            if entry.code == code:
                return entry
        raise FeatureRefused(f"{self.name} holds {code}, which is none of its entries.")

    def number(self) -> Number:
        return self.chosen.numeric

    def assign(self, value: Number) -> None:
        """By the entry's number."""
        for entry in self.entries:
            if entry.code == value:
                self.value = entry.symbol
                return
        raise self._refuse(value, listed(tuple(entry.code for entry in self.entries)))

    def bounds(self) -> tuple[int, int]:
        codes = [entry.code for entry in self.entries] or [0]
        return min(codes), max(codes)

    @abstractmethod
    def _read(self) -> int: ...

    @abstractmethod
    def _write(self, entry: EnumEntry) -> None: ...

    def _choose(self, symbol: str) -> EnumEntry:
        for entry in self.entries:
            if entry.symbol == symbol and entry.available:
                return entry
        raise self._refuse(symbol, listed(self.symbols))


class CommandFeature(Feature, ABC):
    """Something that the camera does when told to."""

    @abstractmethod
    def execute(self) -> None:
        """Tell the camera; returns before it is done."""

    @property
    @abstractmethod
    def done(self) -> bool:
        """Whether the camera has finished; asks it anew each time."""

    @property
    @abstractmethod
    def polling_s(self) -> float:
        """How long to wait between two looks at `done`."""

    def run(self, deadline_s: float) -> None:
        """Execute, and wait until it is done.

        Raises FeatureRefused when it is not within `deadline_s`.
        """
        ends_at = time.monotonic() + deadline_s
        self.execute()
        while not self.done:
            if time.monotonic() >= ends_at:
                raise FeatureRefused(f"{self.name} was not done within {deadline_s:g} s.")
            time.sleep(self.polling_s)


class StringFeature(Feature, ABC):
    """Text."""

    @property
    def value(self) -> str:
        self._require_readable()
        return self._answer("value", self._read)

    @value.setter
    def value(self, value: str) -> None:
        self._require_writable()
        with self._visit(SETTING):
            self._write(value)

    @abstractmethod
    def _read(self) -> str: ...

    @abstractmethod
    def _write(self, value: str) -> None: ...


class RegisterFeature(Feature, ABC):
    """Raw bytes in the camera."""

    @property
    @abstractmethod
    def length(self) -> int:
        """Bytes."""

    @property
    @abstractmethod
    def address(self) -> int: ...

    @property
    def value(self) -> bytes:
        self._require_readable()
        return self._answer("value", self._read)

    @value.setter
    def value(self, value: bytes) -> None:
        self._require_writable()
        with self._visit(SETTING):
            if len(value) != self.length:
                raise self._refuse(value, f"{self.length} bytes")
            self._write(value)

    @abstractmethod
    def _read(self) -> bytes: ...

    @abstractmethod
    def _write(self, value: bytes) -> None: ...


class CategoryFeature(Feature, ABC):
    """A group of features, some of which may be groups."""

    @property
    @abstractmethod
    def features(self) -> tuple[Feature, ...]: ...

    @property
    @abstractmethod
    def absent(self) -> tuple[str, ...]:
        """What it names and the file does not declare."""

    def walk(self) -> Iterator[tuple[int, Feature]]:
        """Everything below it with its depth, from 0 on, in the file's order.

        A category that is met again is not opened again.
        """
        opened = {self.name}
        rest = [(0, feature) for feature in reversed(self.features)]
        while rest:
            depth, feature = rest.pop()
            yield depth, feature
            if isinstance(feature, CategoryFeature) and feature.name not in opened:
                opened.add(feature.name)
                rest += [(depth + 1, below) for below in reversed(feature.features)]
