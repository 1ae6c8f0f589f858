"""Which eye an image or a folder is of, by its name, in the ways that programs name them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

EYES = ("left", "right")
_BETWEEN = "_-. *"


@dataclass(frozen=True, slots=True)
class Naming:
    """One way to tell the eyes apart."""

    pattern: re.Pattern[str]
    """Its group `eye` names the eye."""
    eyes: Mapping[str, str]
    """Left or right, by what that group found, in lower case."""

    def told(self, stem: str) -> tuple[str, str] | None:
        """What both eyes' names share, and the eye; None where the name tells none."""
        found = list(self.pattern.finditer(stem))
        if not found:
            return None
        last = found[-1]
        shared = f"{stem[: last.start()]}*{stem[last.end() :]}".strip(_BETWEEN)
        # Nothing is left of `LEFT.JPG`: it is the only pair.
        return shared or "pair", self.eyes[last["eye"].lower()]


WORDS = Naming(
    # Not as a part of another word, such as bright; but camLeft is of two words.
    re.compile(
        r"(?:(?<![A-Za-z])(?=(?i:left|right))|(?<=[a-z])(?=L|R))"
        r"(?P<eye>(?i:left|right))(?![a-z])"
    ),
    {"left": "left", "right": "right"},
)
"""1_left, left01, LEFT, 12-Right, camLeft."""
NAMINGS = (
    WORDS,
    Naming(
        re.compile(r"(?<![A-Za-z])(?i:camera|cam|image|img|im)[_-]?(?P<eye>[01])(?!\d)"),
        {"0": "left", "1": "right"},
    ),
    Naming(
        re.compile(r"(?<![A-Za-z])(?i:camera|cam)[_-]?(?P<eye>[12])(?!\d)"),
        {"1": "left", "2": "right"},
    ),
    Naming(re.compile(r"(?<![A-Za-z])(?P<eye>[LlRr])(?![A-Za-z])"), {"l": "left", "r": "right"}),
)
"""The first one by which there are pairs counts."""
