"""The names that a node's formulas may use."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from fieldcam.camera.genapi.arithmetic import Number
from fieldcam.camera.genapi.elements import Element, number
from fieldcam.camera.genapi.feature import Numeric, Scope
from fieldcam.camera.genapi.features import EnumerationFeature
from fieldcam.camera.genapi.formula import Domain, Formula, parse_formula
from fieldcam.errors import FeatureFileInvalid

PROPERTIES: Mapping[str, Callable[[Numeric], Number | None]] = {
    "Value": lambda node: node.number(),
    "Min": lambda node: node.bounds()[0],
    "Max": lambda node: node.bounds()[1],
    "Inc": lambda node: node.step(),
}
"""What may follow a variable's name, behind a dot."""
ENTRY_PREFIXES = ("Entry.", "Enum.")


class Variables:
    """pVariable, Constant and Expression of one node."""

    def __init__(self, element: Element, scope: Scope, owner: str, domain: Domain) -> None:
        self._scope = scope
        self._owner = owner
        self._domain = domain
        self._variables = {child.name: child.text for child in element.all("pVariable")}
        self._constants = {child.name: child for child in element.all("Constant")}
        self._expressions = {child.name: child.text for child in element.all("Expression")}
        self._parsed: dict[str, Formula] = {}

    def nodes(self) -> list[Numeric]:
        """The nodes that the variables name."""
        return [self._scope.numeric(node, self._owner) for node in self._variables.values()]

    def lookup(self, name: str) -> Number | None:
        """The value of a name in a formula; None for one that is unknown here."""
        if name in self._constants:
            return number(self._constants[name])
        if name in self._expressions:
            return self._scope.visits.answer(
                self._owner, f"expression {name}", lambda: self._expression(name)
            )
        return self._variable(name)

    def _expression(self, name: str) -> Number:
        if name not in self._parsed:
            self._parsed[name] = parse_formula(self._expressions[name], self._domain)
        formula = self._parsed[name]
        self._scope.visits.charge(self._owner, len(formula.text))
        return formula.evaluate(self.lookup)

    def _variable(self, name: str) -> Number | None:
        """The property may be part of the variable's own name, or be added in the formula."""
        variable, _, asked = name.partition(".")
        node = self._variables.get(name, self._variables.get(variable))
        return None if node is None else self._property(node, asked or "Value")

    def _property(self, name: str, asked: str) -> Number:
        node = self._scope.numeric(name, self._owner)
        found = PROPERTIES[asked](node) if asked in PROPERTIES else self._entry(node, asked)
        if found is None:
            raise FeatureFileInvalid(f"A formula of {self._owner} asks {name} for its {asked}.")
        return found

    def _entry(self, node: Numeric, asked: str) -> Number | None:
        symbol = next((asked[len(p) :] for p in ENTRY_PREFIXES if asked.startswith(p)), None)
        if symbol is None or not isinstance(node, EnumerationFeature):
            return None
        return next((entry.numeric for entry in node.entries if entry.symbol == symbol), None)


class FormulaSource:
    """A formula of a node, with the names that it may use."""

    def __init__(self, element: Element, scope: Scope, owner: str, domain: Domain) -> None:
        self._element = element
        self._scope = scope
        self._owner = owner
        self._domain = domain
        self._formulas: dict[str, Formula] = {}
        self.variables = Variables(element, scope, owner, domain)

    def number(self, tag: str, given: Mapping[str, Number]) -> Number:
        """The result of the formula under `tag`, which may use these names too."""
        if tag not in self._formulas:
            self._formulas[tag] = self._parse(tag)
        formula = self._formulas[tag]
        self._scope.visits.charge(self._owner, len(formula.text))
        return formula.evaluate(
            lambda name: given[name] if name in given else self.variables.lookup(name)
        )

    def _parse(self, tag: str) -> Formula:
        child = self._element.first(tag)
        if child is None:
            raise FeatureFileInvalid(f"The camera's feature file gives {self._owner} no {tag}.")
        return parse_formula(child.text, self._domain)
