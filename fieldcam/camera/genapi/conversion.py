"""One number seen through a pair of formulas, there and back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fieldcam.camera.genapi.arithmetic import Number
from fieldcam.camera.genapi.elements import Element
from fieldcam.camera.genapi.feature import Numeric, Scope
from fieldcam.camera.genapi.formula import Domain
from fieldcam.camera.genapi.variables import FormulaSource
from fieldcam.errors import FeatureFileInvalid, FeatureRefused


class Conversion:
    """FormulaFrom makes the shown number of the carrier's, FormulaTo the carrier's of it."""

    def __init__(self, element: Element, scope: Scope, owner: str, domain: Domain) -> None:
        self._element = element
        self._scope = scope
        self._owner = owner
        self._formulas = FormulaSource(element, scope, owner, domain)

    @property
    def carrier(self) -> Numeric:
        child = self._element.first("pValue")
        if child is None:
            raise FeatureFileInvalid(f"The camera's feature file gives {self._owner} no pValue.")
        return self._scope.numeric(child.text, self._owner)

    def feeders(self) -> Sequence[Numeric]:
        """The nodes that the formulas need."""
        return self._formulas.variables.nodes()

    def number(self) -> Number:
        return self._shown(self.carrier.number())

    def assign(self, value: Number) -> None:
        self.carrier.assign(self._formulas.number("FormulaTo", {"FROM": value}))

    def bounds(self, lowest: Number, highest: Number) -> tuple[Number, Number]:
        """What the carrier's bounds become; these limits where they become nothing.

        Whether the formula rises or falls is seen from its ends, since files
        contradict themselves about it; only Varying says that the ends tell nothing.
        """
        if self._element.words("Slope") == "Varying":
            return lowest, highest
        ends = list(self._ends())
        return (min(ends), max(ends)) if len(ends) == 2 else (lowest, highest)

    def _ends(self) -> Iterator[Number]:
        for bound in self.carrier.bounds():
            try:
                yield self._shown(bound)
            except FeatureRefused:  # a division by zero at the very end, most often
                continue

    def _shown(self, carried: Number) -> Number:
        return self._formulas.number("FormulaFrom", {"TO": carried})
