"""The stretch of a camera's address space behind one register node."""

from __future__ import annotations

from collections.abc import Sequence

from fieldcam.camera.genapi.access import Access
from fieldcam.camera.genapi.elements import HIGHEST_ADDRESS, Element, address, whole_number
from fieldcam.camera.genapi.feature import Numeric, Scope, one_of
from fieldcam.camera.genapi.registers import Caching, RegisterRange, Registers
from fieldcam.camera.genapi.sources import number_of, whole_of
from fieldcam.errors import FeatureFileInvalid, FeatureRefused

LONGEST_REGISTER_BYTES = 2**20


class Stretch:
    """Reads and writes the bytes of one register node, through what is remembered of them."""

    def __init__(self, element: Element, scope: Scope, owner: str) -> None:
        self._element = element
        self._scope = scope
        self._owner = owner

    @property
    def declared_access(self) -> Access:
        """What the file allows."""
        return one_of(Access, self._element.words("AccessMode"), Access.READ_ONLY)

    @property
    def access(self) -> Access:
        """What the file allows, as long as anything is behind the port."""
        behind = self._scope.registers(self._port)
        return Access.NOT_AVAILABLE if behind is None else self.declared_access

    def feeders(self) -> Sequence[Numeric]:
        """The nodes that say where the register is."""
        return [
            self._scope.numeric(child.text, self._owner)
            if child.tag != "IntSwissKnife"
            else self._scope.anonymous(child, self._owner)
            for child in self._element.all("pAddress", "pIndex", "pLength", "IntSwissKnife")
        ]

    @property
    def big_endian(self) -> bool:
        return self._element.words("Endianess") == "BigEndian"

    @property
    def signed(self) -> bool:
        return self._element.words("Sign") == "Signed"

    @property
    def address(self) -> int:
        """The sum of all that the file gives for it."""
        return self._scope.visits.answer(self._owner, "address", self._work_out_address)

    @property
    def length(self) -> int:
        """Bytes."""
        found = self._scope.visits.answer(
            self._owner,
            "length",
            lambda: number_of(self._element, "Length", self._scope, self._owner),
        )
        length = 0 if found is None else whole_of(found, self._owner)
        if not 0 < length <= LONGEST_REGISTER_BYTES:
            raise FeatureFileInvalid(
                f"The camera's feature file gives the register {self._owner} {length} bytes."
            )
        return length

    def read(self) -> bytes:
        place = self._place()
        data = self._scope.cache.find(self._owner, place, self._polling_s())
        if data is None:
            data = self._registers().read(place.address, place.length)
            if len(data) != place.length:
                raise FeatureRefused(
                    f"The camera gave {len(data)} instead of {place.length} bytes of {self._owner}."
                )
            self._scope.cache.remember(self._owner, place, data)
        return data

    def write(self, data: bytes) -> None:
        place = self._place()
        self._registers().write(place.address, data)
        self._scope.cache.forget_place(place)
        if place.caching is Caching.WRITE_THROUGH:
            self._scope.cache.remember(self._owner, place, data)
        self._scope.changed(self._owner)

    @property
    def _port(self) -> str:
        return self._element.words("pPort")

    def _registers(self) -> Registers:
        registers = self._scope.registers(self._port)
        if registers is None:
            raise FeatureRefused(f"{self._owner} came with no image yet.")
        return registers

    def _place(self) -> RegisterRange:
        caching = one_of(Caching, self._element.words("Cachable"), Caching.WRITE_THROUGH)
        return RegisterRange(self._port, self.address, self.length, caching)

    def _polling_s(self) -> float | None:
        child = self._element.first("PollingTime")
        return None if child is None else whole_number(child) / 1000

    def _part(self, child: Element) -> int:
        """What one child adds to the address."""
        if child.tag == "Address":
            return address(child)
        if child.tag == "IntSwissKnife":
            return whole_of(self._scope.anonymous(child, self._owner).number(), self._owner)
        if child.tag not in ("pAddress", "pIndex"):
            return 0
        found = whole_of(self._scope.numeric(child.text, self._owner).number(), self._owner)
        return found if child.tag == "pAddress" else found * self._pitch(child)

    def _work_out_address(self) -> int:
        return sum(self._part(child) for child in self._element.children) & HIGHEST_ADDRESS

    def _pitch(self, index: Element) -> int:
        """Bytes from one index to the next; the register's own length where none is given."""
        offset = index.attributes.get("Offset")
        if offset is not None:
            return whole_number(Element("Offset", {}, text=offset))
        node = index.attributes.get("pOffset")
        if node is not None:
            return whole_of(self._scope.numeric(node, self._owner).number(), self._owner)
        return self.length
