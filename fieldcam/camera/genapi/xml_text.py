"""A feature file's bytes as the text of its XML, without what stands around it.

Whatever is odd about the bytes costs a letter of a description at most: the camera has
no other file, and its features are written in ASCII.
"""

from __future__ import annotations

import codecs
import re

WIDE = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_DECLARATION = re.compile(r"<\?xml\s[^<>]{0,400}\?>")
_ENCODING = re.compile(rb"<\?xml\s[^<>]{0,200}?encoding\s{0,9}=\s{0,9}[\"']([-A-Za-z0-9_.]{1,40})")
_TEXT_CODES = ("utf-8", "ascii", "latin", "iso8859", "cp", "gb", "big5", "shift", "euc", "koi8")
"""How codes begin, by Python's names, that have ASCII's letters in ASCII's places."""
_LINE_BEFORE = 4000
"""Characters: common tools print the camera's name before the XML, and it is saved with it."""
_CONTROLS = re.compile("[\\x00-\\x08\\x0b\\x0c\\x0e-\\x1f\\ufffe\\uffff]")
"""Characters that no XML may hold."""
_STRAY_AMPERSAND = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#\d{1,7}|#x[0-9A-Fa-f]{1,6});)")


def xml_text(data: bytes) -> str:
    """From the document's first element, comment or type on; padding is left behind it."""
    text = _CONTROLS.sub(" ", _decoded(data))
    declaration = _DECLARATION.search(text, 0, _LINE_BEFORE)
    if declaration is not None:
        return text[declaration.end() :].strip()
    begin = text.find("<", 0, _LINE_BEFORE)
    return text[max(begin, 0) :].strip()


def with_ampersands_escaped(text: str) -> str:
    """Where an `&` stands for itself, or for a letter that XML does not know."""
    return text if "<![CDATA[" in text else _STRAY_AMPERSAND.sub("&amp;", text)


def _decoded(data: bytes) -> str:
    if data.startswith(WIDE):
        return data.decode("utf-16", errors="replace")
    if data[:2] in (b"<\0", b"\0<"):
        return data.decode("utf-16-le" if data[0] else "utf-16-be", errors="replace")
    declared = _ENCODING.search(data[:_LINE_BEFORE])
    code = "utf-8" if declared is None else declared[1].decode("ascii")
    try:
        known = codecs.lookup(code).name
    except LookupError:
        known = "utf-8"
    if not known.startswith(_TEXT_CODES):
        known = "utf-8"  # as UTF-16 in a file whose letters have one byte
    try:
        return data.decode("utf-8-sig" if known == "utf-8" else known)
    except UnicodeDecodeError:
        return data.decode("utf-8-sig", errors=_AS_LATIN_1)


def _latin_1(error: UnicodeError) -> tuple[str, int]:
    """What one byte that is no UTF-8 most likely was meant to be."""
    assert isinstance(error, UnicodeDecodeError)
    bad = error.object[error.start : error.end]
    return bad.decode("latin-1"), error.end


_AS_LATIN_1 = "fieldcam.latin-1"
codecs.register_error(_AS_LATIN_1, _latin_1)
