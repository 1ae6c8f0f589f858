"""Operators and functions of the GenApi formula language.

Two whole numbers are worked on in 64-bit two's complement, as the standard's
integer nodes are; as soon as one operand is a float, the result is one. What is
not defined raises ArithmeticError, of which ZeroDivisionError and OverflowError
are kinds.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType

Number = int | float

LOWEST_INT = -(2**63)
HIGHEST_INT = 2**63 - 1
_MODULUS = 2**64
_WORD_BITS = 64


def wrap(value: int) -> int:
    """The 64-bit signed integer with the same low bits."""
    return (value - LOWEST_INT) % _MODULUS + LOWEST_INT


def to_int(value: Number) -> int:
    """Towards zero, as an assignment in C does."""
    if isinstance(value, int):
        return value
    if not LOWEST_INT <= value <= HIGHEST_INT:  # a NaN is outside too
        raise OverflowError(f"{value} is no 64-bit integer")
    return wrap(int(value))


def nearest_int(value: Number) -> int:
    """Rounded, halves away from zero."""
    return to_int(value if isinstance(value, int) else math.copysign(_half_up(abs(value)), value))


def _half_up(value: float) -> float:
    return math.floor(value + 0.5) if math.isfinite(value) else value


def _arithmetic(exact: Callable[[Number, Number], Number]) -> Callable[[Number, Number], Number]:
    def operate(left: Number, right: Number) -> Number:
        result = exact(left, right)
        return wrap(result) if isinstance(result, int) else result

    return operate


def _comparison(holds: Callable[[Number, Number], bool]) -> Callable[[Number, Number], Number]:
    def operate(left: Number, right: Number) -> Number:
        return _like(int(holds(left, right)), left, right)

    return operate


def _bitwise(exact: Callable[[int, int], int]) -> Callable[[Number, Number], Number]:
    def operate(left: Number, right: Number) -> Number:
        return _like(wrap(exact(to_int(left), to_int(right))), left, right)

    return operate


def _like(result: int, left: Number, right: Number) -> Number:
    return result if isinstance(left, int) and isinstance(right, int) else float(result)


def _divide(left: Number, right: Number) -> Number:
    if isinstance(left, int) and isinstance(right, int):
        quotient = abs(left) // abs(right)
        return quotient if (left < 0) == (right < 0) else -quotient
    return left / right


def _remainder(left: Number, right: Number) -> Number:
    """With the sign of `left`, as in C."""
    if right == 0:
        raise ZeroDivisionError("remainder of a division by zero")
    if isinstance(left, int) and isinstance(right, int):
        return int(math.copysign(1, left)) * (abs(left) % abs(right))
    return _defined(math.fmod)(left, right)


def _power(base: Number, exponent: Number) -> Number:
    if isinstance(base, int) and isinstance(exponent, int):
        if exponent >= 0:
            return pow(base, exponent, _MODULUS)
        return to_int(1 / base ** min(-exponent, 2)) if abs(base) != 1 else base ** (exponent % 2)
    try:
        return _defined(math.pow)(base, exponent)
    except OverflowError:
        return math.copysign(math.inf, base)


def _defined(function: Callable[..., float]) -> Callable[..., float]:
    """Python's ValueError for a point outside a function's domain, as ArithmeticError."""

    def call(*arguments: Number) -> float:
        try:
            return function(*arguments)
        except ValueError as error:
            raise ArithmeticError(f"{function.__name__} is not defined there") from error

    return call


def _sign(value: Number) -> Number:
    sign = (value > 0) - (value < 0)
    return sign if isinstance(value, int) else float(sign)


def _round(value: float, digits: Number = 0) -> float:
    """Halves away from zero."""
    scale = math.pow(10.0, max(-300, min(300, to_int(digits))))
    return math.copysign(_half_up(abs(value) * scale) / scale, value)


BINARY: Mapping[str, Callable[[Number, Number], Number]] = MappingProxyType(
    {
        "=": _comparison(operator.eq),
        "<>": _comparison(operator.ne),
        "<": _comparison(operator.lt),
        ">": _comparison(operator.gt),
        "<=": _comparison(operator.le),
        ">=": _comparison(operator.ge),
        "+": _arithmetic(operator.add),
        "-": _arithmetic(operator.sub),
        "*": _arithmetic(operator.mul),
        "/": _arithmetic(_divide),
        "%": _arithmetic(_remainder),
        "**": _arithmetic(_power),
        "&": _bitwise(operator.and_),
        "|": _bitwise(operator.or_),
        "^": _bitwise(operator.xor),
        # Processors take the shift's low six bits.
        "<<": _bitwise(lambda value, count: value << count % _WORD_BITS),
        ">>": _bitwise(lambda value, count: value >> count % _WORD_BITS),
    }
)
"""Operators that always need both operands."""

UNARY: Mapping[str, Callable[[Number], Number]] = MappingProxyType(
    {
        "+": lambda value: value,
        "-": lambda value: BINARY["-"](0, value),
        "~": lambda value: BINARY["^"](value, -1),
        "!": lambda value: BINARY["="](value, 0),
    }
)

FUNCTIONS: Mapping[str, tuple[Callable[..., Number], int, int]] = MappingProxyType(
    {
        "SGN": (_sign, 1, 1),
        "NEG": (UNARY["-"], 1, 1),
        "ABS": (lambda value: BINARY["*"](value, _sign(value)), 1, 1),
        "SQRT": (_defined(math.sqrt), 1, 1),
        "EXP": (math.exp, 1, 1),
        "LN": (_defined(math.log), 1, 1),
        "LG": (_defined(math.log10), 1, 1),
        "SIN": (_defined(math.sin), 1, 1),
        "COS": (_defined(math.cos), 1, 1),
        "TAN": (_defined(math.tan), 1, 1),
        "ASIN": (_defined(math.asin), 1, 1),
        "ACOS": (_defined(math.acos), 1, 1),
        "ATAN": (math.atan, 1, 1),
        "ATAN2": (math.atan2, 2, 2),
        "TRUNC": (lambda value: float(to_int(value)), 1, 1),
        "ROUND": (_round, 1, 2),
        "FLOOR": (lambda value: float(math.floor(to_finite(value))), 1, 1),
        "CEIL": (lambda value: float(math.ceil(to_finite(value))), 1, 1),
    }
)
"""Each function with the least and the most arguments that it takes."""

CONSTANTS: Mapping[str, float] = MappingProxyType({"E": math.e, "PI": math.pi})


def to_finite(value: Number) -> Number:
    """The value itself, unless it is infinite or no number."""
    if not math.isfinite(value):
        raise OverflowError("the result is not finite")
    return value
