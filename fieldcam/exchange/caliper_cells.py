"""What single cells of a caliper table say; each complaint names the cell's place."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from datetime import date

from fieldcam.errors import BadInput

WORDS_FOR_NOTHING = frozenset({"", "na", "n/a", "nan"})
"""What an empty cell looks like; R and spreadsheets write words for it."""
_TIME = r"[ T_]\d{1,2}:\d{2}(?::\d{2}(?:\.\d+)?)?"
"""Spreadsheets write a time behind a date; headings come in lower case, with _ for a space."""
_ISO = re.compile(rf"(\d{{4}})[-./_](\d{{1,2}})[-./_](\d{{1,2}})(?:{_TIME})?", re.IGNORECASE)
_DAY_FIRST = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})")
_SLASHED = re.compile(r"(\d{1,2})[/-](\d{1,2})[/-](\d{4})")
_DECIMAL = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)")
_HOW_TO_WRITE = "Write dates as 2026-05-21."


def day_of(text: str, place: str) -> date:
    """A date in any form that has only one meaning."""
    for year, month, day in _readings(text):
        with suppress(ValueError):
            return date(year, month, day)
    raise BadInput(f"{place}: {text!r} is no date.", _HOW_TO_WRITE)


def is_day(text: str) -> bool:
    """Whether it is written like a date."""
    return any(form.fullmatch(text) for form in (_ISO, _DAY_FIRST, _SLASHED))


def _readings(text: str) -> list[tuple[int, int, int]]:
    """Year, month and day; none where there is more than one meaning."""
    if found := _ISO.fullmatch(text):
        return [(int(found[1]), int(found[2]), int(found[3]))]
    if found := _DAY_FIRST.fullmatch(text):
        return [(int(found[3]), int(found[2]), int(found[1]))]
    if found := _SLASHED.fullmatch(text):
        one, other, year = int(found[1]), int(found[2]), int(found[3])
        if one > 12 or one == other:
            return [(year, other, one)]
        return [(year, one, other)] if other > 12 else []
    return []


def diameter_of(text: str, place: str) -> float | None:
    """Millimetres, with a point or a comma; None for an empty cell."""
    if text.lower() in WORDS_FOR_NOTHING:
        return None
    if not _DECIMAL.fullmatch(text):
        raise BadInput(f"{place}: {text!r} is no diameter in mm.")
    value = float(text.replace(",", "."))
    if value <= 0 or not math.isfinite(value):
        raise BadInput(
            f"{place}: {text} mm is no diameter.", "Leave the cell empty where a fruit has fallen."
        )
    return value


def is_word_for_nothing(text: str) -> bool:
    """Whether a cell is not empty, and says no more."""
    return bool(text) and text.lower() in WORDS_FOR_NOTHING


def whole_of(text: str, place: str, what: str) -> int:
    """A number such as a tag's; spreadsheets write 17.0 for 17 at times."""
    digits = text.removesuffix(".0")
    if not (digits.isascii() and digits.isdigit() and len(digits) < 10):
        said = f"{text!r} is no {what} number" if text else f"the {what} is missing"
        raise BadInput(f"{place}: {said}.")
    return int(digits)


def label_of(text: str) -> str:
    """A fruit's or a tree's name; "1.0" of a spreadsheet is 1."""
    digits = text.removesuffix(".0")
    return str(int(digits)) if digits.isascii() and digits.isdigit() else text
