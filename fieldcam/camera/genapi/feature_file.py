"""Reads a camera's feature file: GenICam XML, plain or zipped, told by its content.

The file comes from a device that nobody vouches for, so everything about it is
bounded: its size, packed and unpacked, its elements and their nesting. Entities are
not expanded. Otherwise it is read as far as it can be: nobody can change a camera.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from fieldcam.camera.genapi.elements import Element
from fieldcam.camera.genapi.unpacking import ASK_THE_MAKER, STARTS, unzipped_xml
from fieldcam.camera.genapi.xml_text import xml_text
from fieldcam.camera.genapi.xml_tree import parsed
from fieldcam.errors import FeatureFileInvalid
from fieldcam.foreign.bounds import FEATURES, MAX_ELEMENTS, MIB

_NOT_ENTRIES = ("StructEntry", "Extension", "ToolTip", "Description", "DisplayName")
"""Children of a StructReg that its entries do not take over."""


@dataclass(frozen=True, slots=True, eq=False)
class FeatureFile:
    """What one feature file declares."""

    vendor: str
    model: str
    schema_version: str
    """Of GenApi, such as 1.1."""
    nodes: Mapping[str, Element]
    """By name; entries of structures are given as MaskedIntReg, groups are dissolved."""


def load_feature_file(data: bytes) -> FeatureFile:
    """Parse a feature file, plain or zipped.

    Raises FeatureFileInvalid.
    """
    root = parsed(xml_text(plain_xml(data)))
    if root.tag != "RegisterDescription":
        raise FeatureFileInvalid(
            f"The file is XML, but begins with {root.tag[:40]} instead of RegisterDescription.",
            ASK_THE_MAKER,
        )
    return _describe(root)


def plain_xml(data: bytes) -> bytes:
    """Unzipped where it is zipped; raises FeatureFileInvalid."""
    padded = data.lstrip(b"\0")
    plain = unzipped_xml(padded) if padded.startswith(STARTS) else data
    if len(plain) > FEATURES.most_bytes:
        raise FeatureFileInvalid(
            f"The feature file is larger than {FEATURES.most_bytes // MIB} MiB.", ASK_THE_MAKER
        )
    return plain


def _describe(root: Element) -> FeatureFile:
    attributes = root.attributes
    # What is declared twice counts as it stands last, as in other readers.
    nodes = {element.name: element for element in _declared(root)}
    return FeatureFile(
        vendor=attributes.get("VendorName", ""),
        model=attributes.get("ModelName", ""),
        schema_version=".".join(
            attributes.get(f"Schema{part}Version", "?") for part in ("Major", "Minor")
        ),
        nodes=nodes,
    )


def _declared(parent: Element) -> Iterator[Element]:
    for element in parent.children:
        if element.tag == "Group":
            yield from _declared(element)
        elif element.tag == "StructReg":
            yield from _entries(element)
        elif element.name:
            yield element


def _entries(structure: Element) -> Iterator[Element]:
    """A structure's entries as registers of their own, with what they share filled in."""
    shared = [child for child in structure.children if child.tag not in _NOT_ENTRIES]
    entries = list(structure.all("StructEntry"))
    if len(entries) * len(shared) > MAX_ELEMENTS:
        raise FeatureFileInvalid(
            f"The feature file's structure {structure.name or 'without a name'} is too large."
        )
    for entry in entries:
        own = {child.tag for child in entry.children}
        children = entry.children + [child for child in shared if child.tag not in own]
        yield Element("MaskedIntReg", entry.attributes, children)
