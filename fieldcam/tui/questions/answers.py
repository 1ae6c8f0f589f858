"""What the operator typed, as values; anything else is BadInput with a sentence."""

from __future__ import annotations

import math
from datetime import date
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.user_folders import expanded

LONGEST_NAME = 60
TAG_SIZES_MM = (5.0, 200.0)
"""Smaller ones cannot be read at 30 cm."""


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
    written = text.strip()
    digits = written.removeprefix("-")
    if not (digits.isascii() and digits.isdigit()):
        raise BadInput(f"{written or 'Nothing'} is no whole number.")
    # So many digits are out of any range, and Python refuses to read them all.
    found = int(written) if len(digits) <= len(str(most)) else most + 1
    if not least <= found <= most:
        raise BadInput(f"It must be between {least} and {most}.")
    return found


def number(text: str, most: int = 1_000_000) -> float:
    """A number from zero on; a comma may part the decimals."""
    try:
        found = float(text.strip().replace(",", "."))
    except ValueError:
        found = math.nan
    if math.isnan(found):
        raise BadInput(f"{text.strip() or 'Nothing'} is no number.")
    if not 0 <= found <= most:
        raise BadInput(f"It must be between 0 and {most}.")
    return found


def tag_size_mm(text: str) -> float:
    """The side of a tag's black square, as a ruler on a card says it."""
    found = number(text)
    if not TAG_SIZES_MM[0] <= found <= TAG_SIZES_MM[1]:
        raise BadInput("A tag's black square has sides of {:g} to {:g} mm.".format(*TAG_SIZES_MM))
    return found


def size_mm(text: str) -> float | None:
    """A diameter by caliper, or none."""
    return number(text, most=100) if text.strip() else None


def day(text: str) -> date:
    try:
        return date.fromisoformat(text.strip())
    except ValueError as error:
        raise BadInput("Write the day as year-month-day, such as 2026-05-19.") from error


def file(text: str) -> Path:
    if not text.strip():
        raise BadInput("Give the name of a file.")
    return expanded(Path(text.strip()))
