"""Where a node's number comes from: the file itself, another node, or an indexed choice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from fieldcam.camera.genapi.arithmetic import Number, nearest_int
from fieldcam.camera.genapi.elements import Element, number
from fieldcam.camera.genapi.feature import Numeric, Scope
from fieldcam.errors import FeatureFileInvalid, FeatureRefused


class NumberSource(Protocol):
    """Something that holds a number."""

    def number(self) -> Number: ...

    def assign(self, value: Number) -> None: ...


class Constant:
    """A number written in the file; setting it changes it for this node map only."""

    def __init__(self, value: Number, owner: str, scope: Scope) -> None:
        self._value = value
        self._owner = owner
        self._scope = scope

    def number(self) -> Number:
        return self._value

    def assign(self, value: Number) -> None:
        self._value = value
        self._scope.changed(self._owner)


class ValueSource:
    """The number behind a node with Value, pValue, or pIndex and indexed values."""

    def __init__(self, element: Element, scope: Scope, owner: str) -> None:
        self._element = element
        self._scope = scope
        self._owner = owner
        self._constants = {
            id(child): Constant(number(child), owner, scope)
            for child in element.all("Value", "ValueIndexed", "ValueDefault")
        }

    def number(self) -> Number:
        return self._source().number()

    def assign(self, value: Number) -> None:
        self._source().assign(value)
        for copy in self._element.all("pValueCopy"):
            self._scope.numeric(copy.text, self._owner).assign(value)

    def carriers(self) -> Sequence[Numeric]:
        """The node that the value is handed on from; none for a constant."""
        source = self._source()
        return (source,) if isinstance(source, Numeric) else ()

    def declared_carriers(self) -> Sequence[Numeric]:
        """The same without asking the camera: none where an index decides."""
        child = None if self._element.first("pIndex") else self._element.first("pValue")
        return () if child is None else (self._scope.numeric(child.text, self._owner),)

    def step(self) -> Number | None:
        return next((carrier.step() for carrier in self.carriers()), None)

    def lowest(self, otherwise: Number) -> Number:
        """What the file says, else the carrier's, else this."""
        return self._limit("Min", 0, otherwise)

    def highest(self, otherwise: Number) -> Number:
        """What the file says, else the carrier's, else this."""
        return self._limit("Max", 1, otherwise)

    def _limit(self, tag: str, end: int, otherwise: Number) -> Number:
        found = number_of(self._element, tag, self._scope, self._owner)
        if found is not None:
            return found
        return next((carrier.bounds()[end] for carrier in self.carriers()), otherwise)

    def _source(self) -> NumberSource:
        index = self._element.first("pIndex")
        if index is not None:
            return self._held_by(self._indexed(self._scope.numeric(index.text, self._owner)))
        return self._held_by(self._element.first("pValue", "Value"))

    def _indexed(self, index: Numeric) -> Element | None:
        wanted = index.number()
        for child in self._element.all("ValueIndexed", "pValueIndexed"):
            if number(Element("Index", {}, text=child.attributes.get("Index", ""))) == wanted:
                return child
        return self._element.first("ValueDefault", "pValueDefault")

    def _held_by(self, child: Element | None) -> NumberSource:
        if child is None:
            raise FeatureFileInvalid(f"The camera's feature file gives {self._owner} no value.")
        constant = self._constants.get(id(child))
        return self._scope.numeric(child.text, self._owner) if constant is None else constant


def whole_of(value: Number, owner: str) -> int:
    """A number that a node took from another one, rounded to 64 bits."""
    try:
        return nearest_int(value)
    except ArithmeticError as error:
        raise FeatureRefused(
            f"{owner} needs a whole number of 64 bits, and is given {value:g}."
        ) from error


def number_of(element: Element, tag: str, scope: Scope, owner: str) -> Number | None:
    """The number under `tag`, or of the node that p`tag` names; None without either."""
    node = element.first(f"p{tag}")
    if node is not None:
        return scope.numeric(node.text, owner).number()
    child = element.first(tag)
    return None if child is None else number(child)
