"""For a terminal whose locale has no UTF-8: the nearest ASCII to what a screen shows."""

from __future__ import annotations

from collections.abc import Mapping
from unicodedata import normalize

from rich.cells import cell_len

_COERCED = ("C.UTF-8", "C.utf8", "UTF-8")
"""What Python itself sets LC_CTYPE to where the locale is C."""
_LIKE = str.maketrans(
    {
        **dict.fromkeys("█▀▄▌▐▇▆▅▃▂", "#"),
        **dict.fromkeys("─━═", "-"),
        **dict.fromkeys("│┃║", "|"),
        **dict.fromkeys("┌┐└┘├┤┬┴┼╭╮╰╯", "+"),
        **dict(zip("←→↑↓▼▲▶◀", "<>^vv^><", strict=True)),
        **dict(zip("…·•", "..*", strict=True)),
        **dict.fromkeys("▔▁▎▊", " "),
    }
)


def has_utf8(environ: Mapping[str, str]) -> bool:
    """What the locale says; one that says nothing is taken for a modern one."""
    ctype = environ.get("LC_CTYPE", "")
    lang = environ.get("LANG", "")
    said = environ.get("LC_ALL") or (ctype if ctype not in _COERCED else lang or ctype) or lang
    return not said or "utf8" in said.lower().replace("-", "")


def in_ascii(text: str) -> str:
    """As wide on the screen as the text was."""
    return text if text.isascii() else "".join(map(_nearest, text.translate(_LIKE)))


def _nearest(letter: str) -> str:
    """Letters without their marks; a question mark for each cell of what ASCII has not."""
    if letter.isascii():
        return letter
    plain = normalize("NFKD", letter)[0]
    width = cell_len(letter)
    return plain if plain.isascii() and width == 1 else "?" * width
