"""Words that sentences of every part share."""

from __future__ import annotations


def number_of(count: int, noun: str) -> str:
    """Such as "1 tag" and "2 tags"; for nouns that only take an s."""
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"
