"""What the operator typed, as values; anything else is BadInput with a sentence."""

from __future__ import annotations

import math
from datetime import date
from pathlib import Path

from fieldcam.errors import BadInput

LONGEST_NAME = 60


def name(text: str, what: str) -> str:
    """`what` names it in the sentence, such as "The block"."""
    found = " ".join(text.split())
    if not found or not found.isprintable():
        raise BadInput(f"{what} needs a name.")
    if len(found) > LONGEST_NAME:
        raise BadInput(f"{what}: at most {LONGEST_NAME} letters.")
    return found


def words(text: str) -> str:
    """One line, perhaps empty."""
    return " ".join(text.split())


def count(text: str, least: int = 0, most: int = 1_000_000) -> int:
    digits = text.strip()
    if not (digits.isascii() and digits.isdigit() and len(digits) < 10):
        raise BadInput(f"{digits or 'Nothing'!s} is no whole number.")
    if not least <= int(digits) <= most:
        raise BadInput(f"It must be between {least} and {most}.")
    return int(digits)


def number(text: str) -> float:
    """A number of at least zero; a comma may part the decimals."""
    try:
        found = float(text.strip().replace(",", "."))
    except ValueError:
        found = math.nan
    if not math.isfinite(found) or found < 0:
        raise BadInput(f"{text.strip() or 'Nothing'} is no number of at least 0.")
    return found


def day(text: str) -> date:
    try:
        return date.fromisoformat(text.strip())
    except ValueError as error:
        raise BadInput("Write the day as year-month-day, such as 2026-05-19.") from error


def file(text: str) -> Path:
    if not text.strip():
        raise BadInput("Give the name of a file.")
    return Path(text.strip()).expanduser()
