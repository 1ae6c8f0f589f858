"""String, Register and Category nodes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

from fieldcam.camera.genapi.access import Access
from fieldcam.camera.genapi.elements import Element
from fieldcam.camera.genapi.feature import Feature, Scope
from fieldcam.camera.genapi.features import CategoryFeature, RegisterFeature, StringFeature
from fieldcam.camera.genapi.in_register import InRegister
from fieldcam.errors import FeatureFileInvalid


class String(StringFeature):
    """A text that the file holds, or that another node carries."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._text = element.words("Value")

    def _carriers(self) -> Sequence[Feature]:
        return (self._carrier,) if self._carrier else ()

    def _read(self) -> str:
        return self._carrier.value if self._carrier else self._text

    def _write(self, value: str) -> None:
        if self._carrier:
            self._carrier.value = value
        else:
            self._text = value
            self._scope.changed(self.name)

    @cached_property
    def _carrier(self) -> StringFeature | None:
        child = self._element.first("pValue")
        if child is None:
            return None
        node = self._scope.node(child.text, self.name)
        if not isinstance(node, StringFeature):
            raise FeatureFileInvalid(
                f"The camera's feature file has {self.name} read text from {node.name}, "
                "which holds none."
            )
        return node


class StringReg(InRegister, StringFeature):
    """Text in a register, ended by a zero byte where it does not fill it."""

    def _read(self) -> str:
        data = self._stretch.read().partition(b"\0")[0]
        try:
            return data.decode("utf-8")
        except UnicodeDecodeError:
            return data.decode("latin-1")

    def _write(self, value: str) -> None:
        data, length = value.encode("utf-8"), self._stretch.length
        if len(data) > length or b"\0" in data:
            raise self._refuse(value, f"text of at most {length} bytes")
        self._stretch.write(data.ljust(length, b"\0"))


class Register(InRegister, RegisterFeature):
    """A register without a meaning of its own, such as a table."""

    @property
    def length(self) -> int:
        return self._stretch.length

    @property
    def address(self) -> int:
        return self._stretch.address

    def _read(self) -> bytes:
        return self._stretch.read()

    def _write(self, value: bytes) -> None:
        self._stretch.write(value)


class Category(CategoryFeature):
    """A list of other nodes, of which ports and the like are no features."""

    @property
    def features(self) -> tuple[Feature, ...]:
        names = self._names
        return tuple(self._scope.node(name, self.name) for name in names if name in self._scope)

    @property
    def absent(self) -> tuple[str, ...]:
        return tuple(name for name in self._names if not self._scope.declares(name))

    @property
    def _names(self) -> Iterator[str]:
        return (child.text for child in self._element.all("pFeature"))

    def _own_access(self) -> Access:
        return Access.READ_ONLY

    def _access_now(self) -> Access:
        there = any(feature.access is not Access.NOT_IMPLEMENTED for feature in self.features)
        return Access.READ_ONLY if there else Access.NOT_IMPLEMENTED
