"""What all nodes share whose value lies in a register of their own."""

from __future__ import annotations

from collections.abc import Sequence

from fieldcam.camera.genapi.access import Access
from fieldcam.camera.genapi.elements import Element
from fieldcam.camera.genapi.feature import Feature, Scope
from fieldcam.camera.genapi.stretch import Stretch


class InRegister(Feature):
    """Stands before the kind of feature that the node is."""

    def __init__(self, element: Element, scope: Scope, name: str = "") -> None:
        super().__init__(element, scope, name)
        self._stretch = Stretch(element, scope, self.name)

    def _own_access(self) -> Access:
        return self._stretch.declared_access

    def _access_now(self) -> Access:
        return self._stretch.access

    def _feeders(self) -> Sequence[Feature]:
        return self._stretch.feeders()
