"""A command of the palette that only one kind of camera has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Trick:
    """What a camera without hardware does when it is told to."""

    name: str
    does: str
    """Shown below the name."""
    play: Callable[[], str]
    """Does it, and says so."""
