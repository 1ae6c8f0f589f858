"""Builds a feature file's elements, within bounds and without entities."""

from __future__ import annotations

from xml.parsers import expat

from fieldcam.camera.genapi.elements import Element
from fieldcam.camera.genapi.unpacking import ASK_THE_MAKER
from fieldcam.camera.genapi.xml_text import with_ampersands_escaped
from fieldcam.errors import FeatureFileInvalid
from fieldcam.foreign.bounds import DEEPEST_ELEMENTS, MAX_ELEMENTS, MAX_FORMULA_TEXT

FORMULAS = ("Formula", "Expression")
"""How the names of elements begin that hold one."""


def parsed(text: str) -> Element:
    """The root; what stands behind its end is none of it. Raises FeatureFileInvalid."""
    try:
        return _Tree().parse(text)
    except expat.ExpatError as strict:
        escaped = with_ampersands_escaped(text)
        if escaped != text:
            try:
                return _Tree().parse(escaped)
            except expat.ExpatError:
                pass  # the first complaint is about the file as it is
        raise FeatureFileInvalid(
            f"The feature file is no proper XML ({strict}).", ASK_THE_MAKER
        ) from strict


class _Tree:
    """Elements from the parser's events; prefixes of names are dropped, declared or not."""

    def __init__(self) -> None:
        self._root: Element | None = None
        self._open: list[tuple[Element, list[str]]] = []
        self._elements = self._formula_text = 0
        self._parser = expat.ParserCreate("utf-8")
        self._parser.buffer_text = True
        # A document type may be named; one that declares opens the door to entity expansion.
        self._parser.EntityDeclHandler = self._refuse_declaration
        self._parser.AttlistDeclHandler = self._refuse_declaration
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text

    def parse(self, text: str) -> Element:
        try:
            self._parser.Parse(text.encode("utf-8", errors="replace"), True)
        except expat.ExpatError:
            if self._root is None or self._open:
                raise
        assert self._root is not None  # the parser accepts no document without one
        return self._root

    def _refuse_declaration(self, *_declared: object) -> None:
        raise FeatureFileInvalid(
            "The feature file's document type declares something of its own.", ASK_THE_MAKER
        )

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._elements += 1
        if self._elements > MAX_ELEMENTS or len(self._open) >= DEEPEST_ELEMENTS:
            raise FeatureFileInvalid("The feature file has too many elements, or nests too deep.")
        element = Element(tag.rpartition(":")[2], attributes)
        if self._open:
            self._open[-1][0].children.append(element)
        else:
            self._root = element
        self._open.append((element, []))

    def _end(self, _tag: str) -> None:
        element, pieces = self._open.pop()
        element.text = "".join(pieces).strip()
        if element.tag.startswith(FORMULAS):
            self._formula_text += len(element.text)
            if self._formula_text > MAX_FORMULA_TEXT:
                raise FeatureFileInvalid("The feature file's formulas are too long.")

    def _text(self, text: str) -> None:
        self._open[-1][1].append(text)
