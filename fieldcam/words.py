"""Words that sentences of every part share."""

from __future__ import annotations

from string import ascii_uppercase


def number_of(count: int, noun: str) -> str:
    """Such as "1 tag" and "2 tags"; for nouns that only take an s."""
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"


def span(interval: tuple[float, float], form: str = ".0f") -> str:
    """Such as "38 to 49"; `form` is that of each number."""
    low, high = interval
    return f"{low:{form}} to {high:{form}}"


def signed(value: float, digits: int = 2) -> str:
    """With the sign that print uses for minus; for pages, not for terminals."""
    return f"{value:+.{digits}f}".replace("-", "\N{MINUS SIGN}")


def give_or_take(sd_mm: float | None) -> str:
    """The standard deviation of a size behind that size, such as " ±0.11"; empty: unknown."""
    return "" if sd_mm is None else f" ±{sd_mm:.2f}"


def letter_of(place: int) -> str:
    """The letter of a place in a list that is counted from 0: A, B ... Z, AA, AB ..."""
    rest, last = divmod(place, len(ascii_uppercase))
    return (letter_of(rest - 1) if rest else "") + ascii_uppercase[last]


def spelled_out(text: str) -> str:
    """Text that can be stored and written: bytes of a file's name that are no UTF-8 (PEP 383)
    are spelled out, such as \\udce9."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
