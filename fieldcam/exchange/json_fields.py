"""Values out of a JSON document, each checked to be of its kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

Json = dict[str, Any]
Part = TypeVar("Part")


def optional(value: object, decode: Callable[[Any], Part]) -> Part | None:
    return None if value is None else decode(value)


def is_whole(value: object) -> bool:
    """Python counts true and false among the integers; JSON does not."""
    return isinstance(value, int) and not isinstance(value, bool)


def whole(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise TypeError(f"{value!r} is no whole number")
    return value


def number(value: object) -> float:
    """A finite number; Python's reader would let NaN pass."""
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise TypeError(f"{value!r} is no number")
    return float(value)


def truth(value: object) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"{value!r} is neither true nor false")
    return value


def text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    return value


def sized(values: object, count: int) -> list[Any]:
    if not isinstance(values, list) or len(values) != count:
        raise ValueError(f"{count} values are needed")
    return values


def point2(values: object) -> tuple[float, float]:
    x, y = (number(value) for value in sized(values, 2))
    return x, y


def point3(values: object) -> tuple[float, float, float]:
    x, y, z = (number(value) for value in sized(values, 3))
    return x, y, z


def box(values: object) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = (number(value) for value in sized(values, 4))
    return x0, y0, x1, y1


def floats(values: tuple[float, ...]) -> list[float]:
    """For writing: numpy's numbers are none to JSON."""
    return [float(value) for value in values]


def float_or_none(value: float | None) -> float | None:
    return None if value is None else float(value)
