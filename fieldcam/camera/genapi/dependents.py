"""Which nodes are out of date once another one has been written."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from functools import cached_property

from fieldcam.camera.genapi.elements import Element

STRUCTURE = frozenset({"pFeature", "pPort", "pAlias", "pCastAlias", "pError", "pTerminal"})
"""References through which no value passes."""
AFFECTS_CARRIERS = frozenset({"pInvalidator", "pSelected"})
"""Through these, what is below a node goes out of date too: the register that it reads."""
CARRIES = frozenset({"pValue", "pValueIndexed", "pValueDefault"})


class Dependents:
    """Follows a feature file's references upwards, from what is read to what is made of it."""

    def __init__(self, nodes: Mapping[str, Element]) -> None:
        self._nodes = nodes
        self._found: dict[str, frozenset[str]] = {}

    def of(self, name: str) -> frozenset[str]:
        """All nodes that a change of this one reaches."""
        if name not in self._found:
            self._found[name] = self._reach(name)
        return self._found[name]

    def carriers(self, name: str) -> frozenset[str]:
        """The node itself and all that its value is handed on from."""
        return frozenset(self._downwards(name, set()))

    def _downwards(self, name: str, passed: set[str]) -> set[str]:
        """The carriers that were not passed before; they are added to what was."""
        found, rest = {name}, [name]
        while rest:
            here = rest.pop()
            passed.add(here)
            element = self._nodes.get(here)
            children = element.children if element is not None else ()
            below = {child.text for child in children if child.tag in CARRIES} - passed - found
            found |= below
            rest += below
        return found

    def _reach(self, name: str) -> frozenset[str]:
        reached: set[str] = set()
        passed: set[str] = set()
        rest = [name]
        while rest:
            for effect, with_carriers in self._effects[rest.pop()]:
                above = self._downwards(effect, passed) if with_carriers else {effect}
                rest += above - reached
                reached |= above
        return frozenset(reached)

    @cached_property
    def _effects(self) -> defaultdict[str, set[tuple[str, bool]]]:
        """By what was changed: what is made of it, and whether all that carries that is meant."""
        effects: defaultdict[str, set[tuple[str, bool]]] = defaultdict(set)
        for name, element in self._nodes.items():
            for reference in _references(element):
                cause, effect = reference.text, name
                if reference.tag == "pSelected":
                    cause, effect = effect, cause
                effects[cause].add((effect, reference.tag in AFFECTS_CARRIERS))
        return effects


def _references(element: Element) -> Iterator[Element]:
    """Of a node, and of what is written inside it."""
    for child in element.children:
        if child.tag[:1] == "p" and child.tag not in STRUCTURE:
            yield child
        yield from _references(child)
