"""A feature file's nodes as plain trees, with the text of numbers turned into numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from fieldcam.camera.genapi.arithmetic import HIGHEST_INT, LOWEST_INT, Number
from fieldcam.errors import FeatureFileInvalid

HIGHEST_ADDRESS = 2**64 - 1
LARGEST_FLOAT = math.ldexp(1 - 2**-53, 1024)


@dataclass(slots=True, eq=False)
class Element:
    """One XML element; namespaces are dropped, attributes are few."""

    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)
    text: str = ""
    """Its own text, without the space around it."""

    @property
    def name(self) -> str:
        """The node's name; empty for an element that is no node."""
        return self.attributes.get("Name", "")

    def first(self, *tags: str) -> Element | None:
        """The first child with one of these tags."""
        return next((child for child in self.children if child.tag in tags), None)

    def all(self, *tags: str) -> Iterator[Element]:
        """The children with one of these tags, in the file's order."""
        return (child for child in self.children if child.tag in tags)

    def words(self, tag: str, otherwise: str = "") -> str:
        """The text of the first child with this tag."""
        child = self.first(tag)
        return otherwise if child is None else child.text


def whole_number(element: Element) -> int:
    """The element's text as a 64-bit signed integer; what is beyond is held at the limit."""
    return max(LOWEST_INT, min(HIGHEST_INT, _integer(element)))


def address(element: Element) -> int:
    """The element's text as an address of 64 bits."""
    return _integer(element) & HIGHEST_ADDRESS


def real_number(element: Element) -> float:
    """The element's text as a finite float; infinity is the largest float."""
    try:
        value = float(element.text)
    except ValueError:
        value = float(_integer(element))
    if math.isnan(value):
        raise _no_number(element)
    return max(-LARGEST_FLOAT, min(LARGEST_FLOAT, value))


def number(element: Element) -> Number:
    """The element's text as it is written: a whole number, or a float."""
    try:
        return whole_number(element)
    except FeatureFileInvalid:
        return real_number(element)


def _integer(element: Element) -> int:
    text = element.text
    if len(text) > 40:
        raise _no_number(element)
    try:
        return int(text, 16) if "x" in text.lower() else int(text)
    except ValueError:
        return _integral_float(element)


def _integral_float(element: Element) -> int:
    """Some files write whole numbers as 1e+06 or 4.0."""
    try:
        value = float(element.text)
    except ValueError as error:
        raise _no_number(element) from error
    if not math.isfinite(value) or not value.is_integer():
        raise _no_number(element)
    return int(value)


def _no_number(element: Element) -> FeatureFileInvalid:
    return FeatureFileInvalid(
        f"The camera's feature file has {element.text[:40]!r} under {element.tag}, "
        "where a number is needed."
    )
