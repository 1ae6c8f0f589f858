"""Reads a camera's feature file: GenICam XML, plain or zipped.

The file comes from a device that nobody vouches for, so everything about it is
bounded: its size, packed and unpacked, its elements and their nesting. A document
type, the door to entity expansion, is refused.
"""

from __future__ import annotations

import codecs
import io
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.parsers import expat

from fieldcam.camera.genapi.elements import Element
from fieldcam.errors import FeatureFileInvalid

LARGEST_FILE_BYTES = 16 * 2**20
MOST_ELEMENTS = 1_000_000
"""The largest camera file seen has 29,000."""
DEEPEST_NESTING = 32

_PADDING = b"\0 \t\r\n"
_ZIP_STARTS = (b"PK\x03\x04", b"PK\x05\x06")
"""The second is of an empty one."""
_CAMERA_LINE = re.compile(rb"(?:<!--[ -~]{1,400}-->|[ -;=-~]{1,400})\r?\n(?=<)")
"""Common tools print the camera's name before the XML, plain or as a comment, and it is
saved with it."""
_READABLE_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 1
_HINT = "Ask the camera's maker for its GenICam XML file."

_NOT_ENTRIES = ("StructEntry", "Extension", "ToolTip", "Description", "DisplayName")
"""Children of a StructReg that its entries do not take over."""


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """What one feature file declares."""

    vendor: str
    model: str
    schema_version: str
    """Of GenApi, such as 1.1."""
    nodes: Mapping[str, Element]
    """By name; entries of structures are given as MaskedIntReg, groups are dissolved."""


def load_feature_file(data: bytes) -> Document:
    """Parse a feature file, plain or zipped.

    Raises FeatureFileInvalid.
    """
    if data.startswith(_ZIP_STARTS):
        data = _unzip(data)
    if len(data) > LARGEST_FILE_BYTES:
        raise _too_large()
    root = _parse(_xml_of(data))
    if root.tag != "RegisterDescription":
        raise FeatureFileInvalid(
            f"The file is XML, but begins with {root.tag[:40]} instead of RegisterDescription.",
            _HINT,
        )
    return _describe(root)


def _unzip(data: bytes) -> bytes:
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
        with archive, archive.open(_only_member(archive)) as member:
            return member.read(LARGEST_FILE_BYTES + 1)
    except (
        zipfile.BadZipFile,
        zlib.error,
        struct.error,
        EOFError,
        OSError,
        ValueError,
        NotImplementedError,
    ) as error:
        raise FeatureFileInvalid("The zipped feature file is damaged.", _HINT) from error


def _only_member(archive: zipfile.ZipFile) -> zipfile.ZipInfo:
    members = [
        info
        for info in archive.infolist()
        if info.filename.lower().endswith(".xml") and not info.filename.startswith("__MACOSX/")
    ]
    if not members:
        raise FeatureFileInvalid("The zip holds no XML file.", _HINT)
    if len(members) > 1:
        raise FeatureFileInvalid(f"The zip holds {len(members)} XML files instead of one.", _HINT)
    member = members[0]
    if member.flag_bits & _ENCRYPTED or member.compress_type not in _READABLE_METHODS:
        raise FeatureFileInvalid("The zip is encrypted, or packed in an unusual way.", _HINT)
    if member.file_size > LARGEST_FILE_BYTES:
        raise _too_large()
    return member


def _xml_of(data: bytes) -> bytes:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data
    stripped = data.strip(_PADDING)
    line = _CAMERA_LINE.match(stripped)
    return stripped[line.end() :] if line else stripped


def _too_large() -> FeatureFileInvalid:
    return FeatureFileInvalid(
        f"The feature file is larger than {LARGEST_FILE_BYTES // 2**20} MiB.", _HINT
    )


def _parse(data: bytes) -> Element:
    builder = _TreeBuilder()
    try:
        builder.parser.Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise FeatureFileInvalid(f"The feature file is no proper XML ({error}).", _HINT) from error
    return builder.root


class _TreeBuilder:
    """Builds elements from the parser's events."""

    def __init__(self) -> None:
        self.root = Element("", {})
        self._open: list[Element] = []
        self._elements = 0
        self.parser = expat.ParserCreate(namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self._refuse_doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text

    def _refuse_doctype(self, *_declaration: object) -> None:
        raise FeatureFileInvalid("The feature file declares a document type.", _HINT)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._elements += 1
        if self._elements > MOST_ELEMENTS or len(self._open) >= DEEPEST_NESTING:
            raise FeatureFileInvalid("The feature file has too many elements, or nests too deep.")
        element = Element(tag.rpartition(" ")[2], attributes)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def _end(self, _tag: str) -> None:
        element = self._open.pop()
        element.text = element.text.strip()

    def _text(self, text: str) -> None:
        self._open[-1].text += text


def _describe(root: Element) -> Document:
    attributes = root.attributes
    nodes: dict[str, Element] = {}
    for element in _declared(root):
        if element.name in nodes:
            raise FeatureFileInvalid(f"The feature file declares {element.name} twice.", _HINT)
        nodes[element.name] = element
    return Document(
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
    for entry in structure.all("StructEntry"):
        own = {child.tag for child in entry.children}
        children = entry.children + [child for child in shared if child.tag not in own]
        yield Element("MaskedIntReg", entry.attributes, children)
