"""What all nodes of a feature file have in common: words, access, and the map they are in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from enum import StrEnum
from typing import Protocol, TypeVar

from fieldcam.camera.genapi.access import Access, Visibility
from fieldcam.camera.genapi.arithmetic import Number
from fieldcam.camera.genapi.elements import Element
from fieldcam.camera.genapi.registers import RegisterCache, Registers
from fieldcam.camera.genapi.visits import Visits
from fieldcam.errors import FeatureRefused

Choice = TypeVar("Choice", bound=StrEnum)
Found = TypeVar("Found")


MAX_LISTED = 20


class Scope(Protocol):
    """The node map, as its nodes see it."""

    cache: RegisterCache
    visits: Visits

    def __contains__(self, name: object) -> bool: ...

    def declares(self, name: str) -> bool: ...

    def node(self, name: str, wanted_by: str) -> Feature:
        """Raises FeatureFileInvalid where the file lacks what one of its nodes refers to."""
        ...

    def numeric(self, name: str, wanted_by: str) -> Numeric: ...

    def anonymous(self, element: Element, owner: str) -> Numeric:
        """A node that is written inside another one."""
        ...

    def registers(self, port: str) -> Registers | None:
        """None where nothing is behind this port now."""
        ...

    def changed(self, name: str) -> None:
        """Forget what depends on this node, which was written."""
        ...

    def refresh(self, name: str) -> None:
        """Forget what this node's value was made of."""
        ...


class Feature:
    """One node of a feature file."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        self.name = name or element.name
        self._element = element
        self._scope = scope

    @property
    def display_name(self) -> str:
        return self._element.words("DisplayName", self.name)

    @property
    def tooltip(self) -> str:
        return self._element.words("ToolTip")

    @property
    def description(self) -> str:
        return self._element.words("Description") or self.tooltip

    @property
    def visibility(self) -> Visibility:
        return one_of(Visibility, self._element.words("Visibility"), Visibility.BEGINNER)

    @property
    def selected(self) -> tuple[str, ...]:
        """Names of the features that this one selects an instance of."""
        return tuple(child.text for child in self._element.all("pSelected"))

    @property
    def declared_access(self) -> Access:
        """What the feature file allows, whatever the camera's state; asks the camera nothing."""
        return self._answer("declared access", self._work_out_declared_access)

    @property
    def access(self) -> Access:
        """What can be done now."""
        return self._scope.visits.access(self.name, self._work_out_access)

    @property
    def conditional(self) -> bool:
        """Whether its access depends on the camera's state."""
        return self._answer("conditional", self._work_out_conditional)

    @property
    def available(self) -> bool:
        return self.access.available

    @property
    def readable(self) -> bool:
        return self.access.readable

    @property
    def writable(self) -> bool:
        return self.access.writable

    def refresh(self) -> None:
        """Have the camera asked again when the value is next read."""
        self._scope.refresh(self.name)

    def _work_out_declared_access(self) -> Access:
        access = self._own_access().within(self._imposed_access())
        for carrier in self._declared_carriers():
            access = access.within(carrier.declared_access)
        return access

    def _work_out_conditional(self) -> bool:
        own = self._element.first("pIsImplemented", "pIsAvailable", "pIsLocked")
        return own is not None or any(c.conditional for c in self._declared_carriers())

    def _work_out_access(self) -> Access:
        if not self._holds("pIsImplemented"):
            return Access.NOT_IMPLEMENTED
        access = self._access_now().within(self._imposed_access())
        for carrier in self._carriers():
            access = access.within(carrier.access)
        for feeder in self._feeders():
            access = access.within(_FED[feeder.access])
        if access is Access.NOT_IMPLEMENTED:
            return access
        if not self._holds("pIsAvailable"):
            return Access.NOT_AVAILABLE
        return access.locked() if self._locked() else access

    def _visit(self, question: str) -> AbstractContextManager[None]:
        return self._scope.visits.visit(self.name, question)

    def _answer(self, question: str, work_out: Callable[[], Found]) -> Found:
        return self._scope.visits.answer(self.name, question, work_out)

    def _own_access(self) -> Access:
        """What this kind of node allows by itself."""
        return Access.READ_WRITE

    def _access_now(self) -> Access:
        """The same, where it depends on the camera's state."""
        return self._own_access()

    def _carriers(self) -> Sequence[Feature]:
        """Nodes that this one hands reading and writing on to."""
        return ()

    def _declared_carriers(self) -> Sequence[Feature]:
        """Those that are known without asking the camera."""
        return self._carriers()

    def _feeders(self) -> Sequence[Feature]:
        """Nodes that must be readable to find or work out this one's value."""
        return ()

    def _imposed_access(self) -> Access:
        return one_of(Access, self._element.words("ImposedAccessMode"), Access.READ_WRITE)

    def _holds(self, condition: str) -> bool:
        child = self._element.first(condition)
        return child is None or self._is_true(child.text)

    def _locked(self) -> bool:
        child = self._element.first("pIsLocked")
        return child is not None and self._is_true(child.text)

    def _is_true(self, name: str) -> bool:
        """A condition that cannot be read does not hold."""
        node = self._scope.numeric(name, self.name)
        return node.readable and node.number() != 0

    def _require_readable(self) -> None:
        access = self.access
        if not access.readable:
            raise FeatureRefused(f"{self.name} cannot be read: {_WHY_NOT_READ[access]}.")

    def _require_writable(self) -> None:
        access = self.access
        if not access.writable:
            raise FeatureRefused(f"{self.name} cannot be set: {_WHY_NOT_WRITTEN[access]}.")

    def _refuse(self, value: object, allowed: str) -> FeatureRefused:
        return FeatureRefused(f"{self.name} cannot be {value!r}: it takes {allowed}.")


_FED = {
    Access.NOT_IMPLEMENTED: Access.NOT_IMPLEMENTED,
    Access.NOT_AVAILABLE: Access.NOT_AVAILABLE,
    Access.WRITE_ONLY: Access.NOT_AVAILABLE,
    Access.READ_ONLY: Access.READ_WRITE,
    Access.READ_WRITE: Access.READ_WRITE,
}
"""What a node may at most allow, by the access of one that feeds it."""
_NOT_THERE = {
    Access.NOT_IMPLEMENTED: "this camera does not have it",
    Access.NOT_AVAILABLE: "it is not available with the camera's present settings",
}
_WHY_NOT_READ = _NOT_THERE | {Access.WRITE_ONLY: "it can only be set"}
_WHY_NOT_WRITTEN = _NOT_THERE | {Access.READ_ONLY: "it can only be read, or is locked now"}


class Numeric(Feature, ABC):
    """A feature that a formula, or another feature, can take a number from."""

    @abstractmethod
    def number(self) -> Number: ...

    @abstractmethod
    def assign(self, value: Number) -> None: ...

    @abstractmethod
    def bounds(self) -> tuple[Number, Number]: ...

    def step(self) -> Number | None:
        return None


def one_of(kind: type[Choice], text: str, otherwise: Choice) -> Choice:
    """What `text` names; `otherwise` where it names nothing, as files made by hand may."""
    try:
        return kind(text)
    except ValueError:
        return otherwise


def listed(values: Sequence[object]) -> str:
    """Allowed values, as a message names them."""
    if not values:
        return "nothing now"
    more = f" and {len(values) - MAX_LISTED} more" if len(values) > MAX_LISTED else ""
    return ", ".join(str(value) for value in values[:MAX_LISTED]) + more
