"""The GenICam description of the emulated camera, written from its table of features."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .features import (
    Bits,
    Button,
    Choice,
    Delivered,
    Derived,
    Feature,
    Integer,
    Lock,
    Real,
    Scaled,
    Switch,
    Text,
)
from .layout import STRIDE, Slot
from .registers import Access

NAMESPACE = "http://www.genicam.org/GenApi/Version_1_1"


def description(model: str, features: Iterable[Feature], slots: Mapping[str, Slot]) -> bytes:
    """The XML file."""
    features = tuple(features)
    root = _root(model)
    _categories(root, features)
    place = _Place(root, features, slots)
    for feature in features:
        _write(place, feature)
    SubElement(root, "Port", Name="Device")
    indent(root)
    return b'<?xml version="1.0" encoding="utf-8"?>\n' + tostring(root, encoding="unicode").encode()


def _root(model: str) -> Element:
    return Element(
        "RegisterDescription",
        {
            "xmlns": NAMESPACE,
            "ModelName": model,
            "VendorName": "Emulated",
            "ToolTip": "A camera made of software",
            "StandardNameSpace": "None",
            "SchemaMajorVersion": "1",
            "SchemaMinorVersion": "1",
            "SchemaSubMinorVersion": "0",
            "MajorVersion": "1",
            "MinorVersion": "0",
            "SubMinorVersion": "0",
            "ProductGuid": "5f0ea2d4-0c5b-4b8e-8f5e-6a30d3a1f001",
            "VersionGuid": "5f0ea2d4-0c5b-4b8e-8f5e-6a30d3a1f002",
        },
    )


def _categories(root: Element, features: tuple[Feature, ...]) -> None:
    names = list(dict.fromkeys(feature.category for feature in features))
    top = SubElement(root, "Category", Name="Root", NameSpace="Standard")
    for name in names:
        _text(top, "pFeature", name)
    for name in names:
        category = SubElement(root, "Category", Name=name, NameSpace="Standard")
        for feature in features:
            if feature.category == name:
                _text(category, "pFeature", feature.name)


class _Place:
    """Where nodes are added, and what they refer to."""

    def __init__(
        self, root: Element, features: tuple[Feature, ...], slots: Mapping[str, Slot]
    ) -> None:
        self.root = root
        self.slots = slots
        self.selected: dict[str, list[str]] = {}
        for feature in features:
            if feature.selector:
                self.selected.setdefault(feature.selector, []).append(feature.name)

    def node(self, kind: str, feature: Feature) -> Element:
        """What a user sees of a feature, as far as all kinds have it in common."""
        node = SubElement(self.root, kind, Name=feature.name, NameSpace="Standard")
        _text(node, "DisplayName", feature.name)
        _text(node, "Visibility", feature.shown)
        if feature.available_by:
            _text(node, "pIsAvailable", f"{feature.available_by}Reg")
        if feature.lock is not Lock.NEVER:
            _text(node, "pIsLocked", feature.lock.value)
        return node

    def selects(self, node: Element, feature: Feature) -> None:
        for name in self.selected.get(feature.name, ()):
            _text(node, "pSelected", name)

    def register(self, kind: str, feature: Feature) -> Element:
        """The register node of a feature, in the order of elements that the schema wants."""
        slot = self.slots[feature.name]
        node = SubElement(self.root, kind, Name=f"{feature.name}Reg", NameSpace="Custom")
        _text(node, "Address", f"0x{slot.address:X}")
        if feature.selector and slot.count > 1:
            SubElement(node, "pIndex", Offset=str(STRIDE)).text = feature.selector
        _text(node, "Length", str(slot.length))
        _text(node, "AccessMode", feature.access.value)
        _text(node, "pPort", "Device")
        if feature.volatile or isinstance(feature, Button):
            _text(node, "Cachable", "NoCache")
        for name in feature.changed_by:
            _text(node, "pInvalidator", name)
        return node

    def whole_number(self, feature: Feature, sign: str = "Unsigned") -> None:
        node = self.register("IntReg", feature)
        _text(node, "Sign", sign)
        _text(node, "Endianess", "LittleEndian")


def _write(place: _Place, feature: Feature) -> None:
    match feature:
        case Integer():
            _integer(place, feature)
        case Real():
            _real(place, feature)
        case Scaled():
            _scaled(place, feature)
        case Choice():
            _choice(place, feature)
        case Switch():
            _switch(place, feature)
        case Button():
            _button(place, feature)
        case Bits():
            _bits(place, feature)
        case Text():
            _string(place, feature)
        case Derived():
            _derived(place, feature)
        case Delivered():
            _delivered(place, feature)


def _text(parent: Element, tag: str, text: str) -> None:
    SubElement(parent, tag).text = text


def _integer(place: _Place, feature: Integer) -> None:
    node = place.node("Integer", feature)
    _text(node, "pValue", f"{feature.name}Reg")
    if feature.access is Access.RW:
        _text(node, "Min", str(feature.minimum))
        tag = "Max" if isinstance(feature.maximum, int) else "pMax"
        _text(node, tag, str(feature.maximum))
        _text(node, "Inc", str(feature.increment))
    place.selects(node, feature)
    place.whole_number(feature)


def _real(place: _Place, feature: Real) -> None:
    node = place.node("Float", feature)
    _text(node, "pValue", f"{feature.name}Reg")
    _limits(node, feature)
    register = place.register("FloatReg", feature)
    _text(register, "Endianess", "LittleEndian")


def _limits(node: Element, feature: Real | Scaled) -> None:
    _text(node, "Min", repr(feature.minimum))
    _text(node, "Max", repr(feature.maximum))
    if feature.unit:
        _text(node, "Unit", feature.unit)


def _scaled(place: _Place, feature: Scaled) -> None:
    node = place.node("Float", feature)
    _text(node, "pValue", f"{feature.name}Converter")
    _limits(node, feature)
    converter = SubElement(place.root, "Converter", Name=f"{feature.name}Converter")
    _text(converter, "FormulaTo", f"FROM * {feature.per_unit}")
    _text(converter, "FormulaFrom", f"TO / {feature.per_unit}.0")
    _text(converter, "pValue", f"{feature.name}Reg")
    _text(converter, "Slope", "Increasing")
    place.whole_number(feature, "Signed" if feature.signed else "Unsigned")


def _choice(place: _Place, feature: Choice) -> None:
    node = place.node("Enumeration", feature)
    for name, value in feature.entries.items():
        entry = SubElement(node, "EnumEntry", Name=name, NameSpace="Standard")
        _text(entry, "DisplayName", name)
        _text(entry, "Value", str(value))
    _text(node, "pValue", f"{feature.name}Reg")
    place.selects(node, feature)
    place.whole_number(feature)


def _switch(place: _Place, feature: Switch) -> None:
    node = place.node("Boolean", feature)
    _text(node, "pValue", f"{feature.name}Reg")
    _text(node, "OnValue", "1")
    _text(node, "OffValue", "0")
    place.whole_number(feature)


def _button(place: _Place, feature: Button) -> None:
    node = place.node("Command", feature)
    _text(node, "pValue", f"{feature.name}Reg")
    _text(node, "CommandValue", "1")
    place.whole_number(feature)


def _bits(place: _Place, feature: Bits) -> None:
    """A bit that moves with the selector: out of the register by a SwissKnife."""
    node = place.node("Boolean", feature)
    _text(node, "pValue", f"{feature.name}Bit")
    _text(node, "OnValue", "1")
    _text(node, "OffValue", "0")
    assert feature.selector
    variables = {"ALL": f"{feature.of}Reg", "LINE": feature.selector}
    _knife(place.root, f"{feature.name}Bit", "(ALL >> LINE) & 1", variables)


def _knife(root: Element, name: str, formula: str, variables: Mapping[str, str]) -> None:
    node = SubElement(root, "IntSwissKnife", Name=name)
    for variable, target in variables.items():
        SubElement(node, "pVariable", Name=variable).text = target
    _text(node, "Formula", formula)


def _string(place: _Place, feature: Text) -> None:
    node = SubElement(place.root, "StringReg", Name=feature.name, NameSpace="Standard")
    _text(node, "DisplayName", feature.name)
    _text(node, "Visibility", feature.shown)
    _text(node, "Address", f"0x{feature.address:X}")
    _text(node, "Length", str(feature.length))
    _text(node, "AccessMode", feature.access.value)
    _text(node, "pPort", "Device")


def _derived(place: _Place, feature: Derived) -> None:
    node = place.node("Integer", feature)
    _text(node, "pValue", f"{feature.name}Expr")
    registers = {name: f"{target}Reg" for name, target in feature.variables.items()}
    _knife(place.root, f"{feature.name}Expr", feature.formula, registers)


def _delivered(place: _Place, feature: Delivered) -> None:
    node = place.node("Float" if feature.is_real else "Integer", feature)
    _text(node, "pValue", f"{feature.name}Reg")
    kind = "FloatReg" if feature.is_real else "IntReg"
    register = SubElement(place.root, kind, Name=f"{feature.name}Reg", NameSpace="Custom")
    _text(register, "Address", "0x0")
    _text(register, "Length", str(feature.length))
    _text(register, "AccessMode", "RO")
    _text(register, "pPort", f"{feature.name}Port")
    _text(register, "Cachable", "NoCache")
    if not feature.is_real:
        _text(register, "Sign", "Unsigned")
    _text(register, "Endianess", "LittleEndian")
    port = SubElement(place.root, "Port", Name=f"{feature.name}Port", NameSpace="Custom")
    _text(port, f"{feature.kind}ID", f"{feature.port_id:X}")
