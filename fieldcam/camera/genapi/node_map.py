"""A camera's features by name, bound to its registers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property

from fieldcam.camera.genapi import choices, floats, integers, texts
from fieldcam.camera.genapi.dependents import Dependents
from fieldcam.camera.genapi.elements import Element
from fieldcam.camera.genapi.feature import Feature, Numeric, Scope
from fieldcam.camera.genapi.feature_file import FeatureFile
from fieldcam.camera.genapi.features import (
    BooleanFeature,
    CategoryFeature,
    CommandFeature,
    EnumerationFeature,
    RegisterFeature,
    StringFeature,
)
from fieldcam.camera.genapi.number_features import FloatFeature, IntegerFeature
from fieldcam.camera.genapi.registers import RegisterCache, Registers
from fieldcam.camera.genapi.visits import Visits
from fieldcam.errors import FeatureFileInvalid, FeatureMissing

ROOT = "Root"

NODE_TYPES: Mapping[str, Callable[[Element, Scope, str], Feature]] = {
    "Boolean": choices.Boolean,
    "Category": texts.Category,
    "Command": choices.CommandNode,
    "Converter": floats.Converter,
    "Enumeration": choices.Enumeration,
    "Float": floats.Float,
    "FloatReg": floats.FloatReg,
    "IntConverter": integers.IntConverter,
    "IntReg": integers.IntReg,
    "IntSwissKnife": integers.IntSwissKnife,
    "Integer": integers.Integer,
    "MaskedIntReg": integers.MaskedIntReg,
    "Register": texts.Register,
    "String": texts.String,
    "StringReg": texts.StringReg,
    "SwissKnife": floats.SwissKnife,
}
"""By the tag in the feature file; Port, ConfRom and the like are no features."""


class NodeMap:
    """The features that a feature file declares, on one camera.

    Nodes are made when they are first asked for. One thread uses it at a time.
    """

    def __init__(self, document: FeatureFile, registers: Registers) -> None:
        self.document = document
        self.cache = RegisterCache()
        self._registers = registers
        self._nodes: dict[str, Feature] = {}
        self._inner: dict[int, Numeric] = {}
        self._dependents = Dependents(document.nodes)
        self.visits = Visits()

    def __contains__(self, name: object) -> bool:
        element = self.document.nodes.get(name) if isinstance(name, str) else None
        return element is not None and element.tag in NODE_TYPES

    def declares(self, name: str) -> bool:
        """Whether the file has this node, be it a feature or not."""
        return name in self.document.nodes

    def __iter__(self) -> Iterator[str]:
        """Names of all features, in the file's order."""
        return (name for name in self.document.nodes if name in self)

    def __getitem__(self, name: str) -> Feature:
        """Raises FeatureMissing."""
        if name not in self:
            raise FeatureMissing(f"The camera has no feature {name}.")
        if name not in self._nodes:
            element = self.document.nodes[name]
            self._nodes[name] = NODE_TYPES[element.tag](element, self, name)
        return self._nodes[name]

    @property
    def root(self) -> CategoryFeature:
        """The category that everything meant to be seen is below."""
        if ROOT not in self:
            raise FeatureFileInvalid(f"The camera's feature file has no category {ROOT}.")
        return self.category(ROOT)

    def integer(self, name: str) -> IntegerFeature:
        """This feature; raises FeatureMissing where there is none, or one of another kind."""
        feature = self[name]
        if not isinstance(feature, IntegerFeature):
            raise self._other_kind(name, "integer")
        return feature

    def floating(self, name: str) -> FloatFeature:
        feature = self[name]
        if not isinstance(feature, FloatFeature):
            raise self._other_kind(name, "float")
        return feature

    def boolean(self, name: str) -> BooleanFeature:
        feature = self[name]
        if not isinstance(feature, BooleanFeature):
            raise self._other_kind(name, "boolean")
        return feature

    def enumeration(self, name: str) -> EnumerationFeature:
        feature = self[name]
        if not isinstance(feature, EnumerationFeature):
            raise self._other_kind(name, "enumeration")
        return feature

    def command(self, name: str) -> CommandFeature:
        feature = self[name]
        if not isinstance(feature, CommandFeature):
            raise self._other_kind(name, "command")
        return feature

    def string(self, name: str) -> StringFeature:
        feature = self[name]
        if not isinstance(feature, StringFeature):
            raise self._other_kind(name, "string")
        return feature

    def register(self, name: str) -> RegisterFeature:
        feature = self[name]
        if not isinstance(feature, RegisterFeature):
            raise self._other_kind(name, "register")
        return feature

    def category(self, name: str) -> CategoryFeature:
        feature = self[name]
        if not isinstance(feature, CategoryFeature):
            raise self._other_kind(name, "category")
        return feature

    def node(self, name: str, wanted_by: str) -> Feature:
        if name not in self:
            raise FeatureFileInvalid(
                f"In the camera's feature file {wanted_by} needs {name}, which is not there."
            )
        return self[name]

    def numeric(self, name: str, wanted_by: str) -> Numeric:
        node = self.node(name, wanted_by)
        if not isinstance(node, Numeric):
            raise FeatureFileInvalid(
                f"In the camera's feature file {wanted_by} takes a number from {name}, "
                "which has none."
            )
        return node

    def anonymous(self, element: Element, owner: str) -> Numeric:
        if id(element) not in self._inner:
            # A name of its own: those written inside may repeat, or be the same as a node's.
            name = f"{owner}'s formula {len(self._inner) + 1}"
            self._inner[id(element)] = integers.IntSwissKnife(element, self, name)
        return self._inner[id(element)]

    def registers(self, port: str) -> Registers | None:
        return None if port in self._foreign_ports else self._registers

    def changed(self, name: str) -> None:
        self.visits.forget()
        self.cache.forget_nodes(self._dependents.of(name))

    def refresh(self, name: str) -> None:
        self.visits.forget()
        self.cache.forget_nodes(self._dependents.carriers(name))

    def forget(self) -> None:
        """Read everything anew: the camera changed on its own, as by a stored set."""
        self.visits.forget()
        self.cache.clear()

    def _other_kind(self, name: str, wanted: str) -> FeatureMissing:
        tag = self.document.nodes[name].tag
        return FeatureMissing(f"The camera's feature {name} is no {wanted}, but {tag}.")

    @cached_property
    def _foreign_ports(self) -> frozenset[str]:
        """Ports that are not the camera's own registers: chunks and events."""
        return frozenset(
            name
            for name, element in self.document.nodes.items()
            if element.tag == "Port" and element.first("ChunkID", "pChunkID", "EventID")
        )
