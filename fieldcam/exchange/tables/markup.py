"""What the XML of a workbook costs to read, found out before its sheets are built of it.

The libraries that build them take some 20 microseconds for each element; this takes one.
"""

from __future__ import annotations

from contextlib import suppress
from typing import IO
from xml.parsers import expat
from zipfile import ZipFile

from fieldcam.errors import BadInput
from fieldcam.exchange.tables.sheets import too_large
from fieldcam.foreign.bounds import DEEPEST_ELEMENTS, MAX_ELEMENTS, MAX_HOLLOW_ELEMENTS

_COPY_IT = "Copy the filled cells into a new workbook, and save that."


def check_markup(name: str, archive: ZipFile) -> None:
    """Raises BadInput where the parts hold too many elements together, or nest them too deep.

    A part that is no XML, a picture say, is none of its concern.
    """
    count = _Count(name)
    for part in archive.infolist():
        with archive.open(part) as content, suppress(expat.ExpatError, LookupError):
            count.add(content)


class _Count:
    """Elements of a workbook's parts, as they come."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._elements = self._hollow = self._depth = 0
        self._nothing_yet = False

    def add(self, content: IO[bytes]) -> None:
        parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text
        parser.EntityDeclHandler = _leave
        self._depth = 0
        parser.ParseFile(content)

    def _start(self, _tag: str, _attributes: dict[str, str]) -> None:
        self._elements += 1
        self._depth += 1
        self._nothing_yet = True
        if self._elements > MAX_ELEMENTS:
            raise too_large(self._name, f"more than {MAX_ELEMENTS:,} rows, cells and values")
        if self._depth > DEEPEST_ELEMENTS:
            raise BadInput(
                f"{self._name} is damaged: its cells lie in cells, too deep to be read.", _COPY_IT
            )

    def _end(self, _tag: str) -> None:
        self._depth -= 1
        self._hollow += self._nothing_yet
        self._nothing_yet = False
        if self._hollow > MAX_HOLLOW_ELEMENTS:
            raise BadInput(
                f"{self._name} holds more than {MAX_HOLLOW_ELEMENTS:,} empty rows and cells.",
                _COPY_IT,
            )

    def _text(self, text: str) -> None:
        self._nothing_yet = self._nothing_yet and text.isspace()


def _leave(*_declared: object) -> None:
    """The reader refuses it: entities may grow without end."""
    raise expat.ExpatError
