"""What single cells of a caliper table say; each complaint names the cell's place."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from fieldcam.errors import BadInput
from fieldcam.growth.records import Presence

FALLEN = frozenset({"fallen", "fell", "dropped", "drop", "abscised", "shed", "gone", "thinned"})
NOT_MEASURED = frozenset(
    {"not_measured", "nm", "n.m.", "not_seen", "hidden", "missed", "missing", "skipped", "?"}
    | {"not_found", "not_recorded", "nr", "n.r.", "unknown"}
)
NOTHING = frozenset({"na", "n/a", "nan", "#n/a", "null", "none", "n.a."})
"""What programs write for an empty cell, and people for what they did not measure."""
_DECIMAL = re.compile(r"([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+))(?: ?mm)?", re.IGNORECASE)
WORDS = "Leave the cell empty, or write fallen or not measured."


@dataclass(frozen=True, slots=True)
class SizeCell:
    """A size, or what stands in its stead."""

    diameter_mm: float | None = None
    presence: Presence | None = None
    """What a word says: FALLEN or NOT_SEEN."""
    nothing: str = ""
    """A word of NOTHING, which only the whole table can explain."""


def size_of(text: str, place: str) -> SizeCell:
    """Millimetres with a point or a comma, a word, or an empty cell."""
    word = "_".join(text.lower().split())
    if not word:
        return SizeCell()
    if word in NOTHING:
        return SizeCell(nothing=text)
    if word in FALLEN:
        return SizeCell(presence=Presence.FALLEN)
    if word in NOT_MEASURED:
        return SizeCell(presence=Presence.NOT_SEEN)
    return SizeCell(diameter_of(text, place))


def diameter_of(text: str, place: str) -> float:
    """Millimetres, with a point or a comma."""
    written = _DECIMAL.fullmatch(text)
    if written is None:
        raise BadInput(f"{place}: {text!r} is no diameter in mm.", WORDS)
    value = float(written[1].replace(",", "."))
    if value <= 0 or not math.isfinite(value):
        raise BadInput(f"{place}: {text} mm is no diameter.", WORDS)
    return value


def whole_of(text: str, place: str, what: str) -> int:
    """A number such as a tag's."""
    number = whole_number(text)
    if number is None:
        said = f"{text!r} is no {what} number" if text else f"the {what} is missing"
        raise BadInput(f"{place}: {said}.")
    return number


def whole_number(text: str) -> int | None:
    """Of nine digits at most; None for anything else."""
    digits = _digits(text)
    return int(digits) if 0 < len(digits) < 10 else None


def label_of(text: str) -> str:
    """A fruit's or a tree's name; "01" is 1."""
    digits = _digits(text)
    return str(int(digits)) if digits else text


def _digits(text: str) -> str:
    """Of a whole number, empty for anything else; spreadsheets write 17.0 for 17 at times."""
    digits = text.removesuffix(".0")
    return digits if digits.isascii() and digits.isdigit() else ""
