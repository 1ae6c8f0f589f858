"""Boolean, Enumeration and Command nodes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from fieldcam.camera.genapi.access import Access
from fieldcam.camera.genapi.arithmetic import Number
from fieldcam.camera.genapi.elements import Element, number, whole_number
from fieldcam.camera.genapi.feature import Feature, Scope
from fieldcam.camera.genapi.features import (
    BooleanFeature,
    CommandFeature,
    EnumEntry,
    EnumerationFeature,
)
from fieldcam.camera.genapi.sources import ValueSource, number_of, whole_of
from fieldcam.camera.genapi.visits import SETTING
from fieldcam.errors import FeatureFileInvalid, FeatureRefused

DEFAULT_POLLING_S = 0.01


class Boolean(BooleanFeature):
    """On and off as two numbers, which are 1 and 0 unless the file says otherwise."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._source = ValueSource(_spelt_out(element), scope, self.name)

    def _carriers(self) -> Sequence[Feature]:
        return self._source.carriers()

    def _declared_carriers(self) -> Sequence[Feature]:
        return self._source.declared_carriers()

    def _read(self) -> bool:
        found = self._source.number()
        if found not in (self._code(True), self._code(False)):
            raise FeatureRefused(f"{self.name} holds {found}, which is neither on nor off.")
        return found == self._code(True)

    def _write(self, value: bool) -> None:
        self._source.assign(self._code(value))

    def _code(self, value: bool) -> int:
        child = self._element.first("OnValue" if value else "OffValue")
        return int(value) if child is None else whole_number(child)


def _spelt_out(element: Element) -> Element:
    """Some files give a Boolean its constant value as true and false."""
    words = {"true": "1", "false": "0"}
    children = [
        Element(c.tag, c.attributes, c.children, words.get(c.text.lower(), c.text))
        if c.tag == "Value"
        else c
        for c in element.children
    ]
    return Element(element.tag, element.attributes, children, element.text)


class Entry(EnumEntry):
    """An EnumEntry of the file."""

    @cached_property
    def code(self) -> int:
        child = self._element.first("Value")
        if child is None:
            raise FeatureFileInvalid(f"The camera's feature file gives {self.name} no value.")
        return whole_number(child)

    @cached_property
    def numeric(self) -> Number:
        child = self._element.first("NumericValue")
        return self.code if child is None else number(child)

    def _own_access(self) -> Access:
        return Access.READ_ONLY


class Enumeration(EnumerationFeature):
    """Named numbers."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._source = ValueSource(element, scope, self.name)

    @cached_property
    def entries(self) -> tuple[EnumEntry, ...]:
        return tuple(
            Entry(child, self._scope, entry_name(self._element, child))
            for child in self._element.all("EnumEntry")
        )

    def _access_now(self) -> Access:
        found = {entry.access for entry in self.entries}
        if Access.READ_ONLY in found:
            return Access.READ_WRITE
        missing = found <= {Access.NOT_IMPLEMENTED}
        return Access.NOT_IMPLEMENTED if missing else Access.NOT_AVAILABLE

    def _carriers(self) -> Sequence[Feature]:
        return self._source.carriers()

    def _declared_carriers(self) -> Sequence[Feature]:
        return self._source.declared_carriers()

    def _read(self) -> int:
        return whole_of(self._source.number(), self.name)

    def _write(self, entry: EnumEntry) -> None:
        self._source.assign(entry.code)
        if entry.self_clearing:
            self.refresh()


def entry_name(enumeration: Element, entry: Element) -> str:
    """Under which the standard counts an entry among the nodes."""
    return f"EnumEntry_{enumeration.name}_{entry.name}"


class CommandNode(CommandFeature):
    """A number that is written to start something."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._source = ValueSource(element, scope, self.name)

    def execute(self) -> None:
        self._require_writable()
        with self._visit(SETTING):
            self._source.assign(self._code())

    @property
    def done(self) -> bool:
        with self._visit("done"):
            if not all(carrier.readable for carrier in self._source.carriers()):
                return True
            self.refresh()
            return self._source.number() != self._code()

    @property
    def polling_s(self) -> float:
        child = self._element.first("PollingTime")
        return DEFAULT_POLLING_S if child is None else max(0.001, whole_number(child) / 1000)

    def _carriers(self) -> Sequence[Feature]:
        return self._source.carriers()

    def _declared_carriers(self) -> Sequence[Feature]:
        return self._source.declared_carriers()

    def _code(self) -> Number:
        found = number_of(self._element, "CommandValue", self._scope, self.name)
        return 1 if found is None else found
