"""Formulas of feature files give what the camera's maker meant."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcam.camera.genapi.formula import REAL, WHOLE, Domain, parse_formula
from fieldcam.errors import FeatureFileInvalid, FeatureRefused, FieldcamError

VARIABLES = {"A": 7, "B": 3, "ZERO": 0, "SEL.Max": 9}


def whole(text: str) -> int | float:
    return parse_formula(text, WHOLE).evaluate(VARIABLES.get)


def real(text: str) -> int | float:
    return parse_formula(text, REAL).evaluate(VARIABLES.get)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1+2*3", 7),
        ("8-2-1", 5),
        ("-7/2", -3),
        ("7/-2", -3),
        ("-7%3", -1),
        ("7%-3", 1),
        ("2**3", 8),
        ("2**3**2", 64),
        ("-2**2", 4),
        ("2**-1", 0),
        ("1<<63", -(2**63)),
        ("1<<64", 1),
        ("-8>>1", -4),
        ("9223372036854775807+1", -(2**63)),
        ("100000000000*100000000000", 1864712049423024128),
        ("0xFF", 255),
        ("0xFFFFFFFFFFFFFFFF", -1),
        ("0xFFFFFFFF & ~0xF", 0xFFFFFFF0),
        ("5=5", 1),
        ("5<>4", 1),
        ("A=7 && B=4 || 1", 1),
        ("A=7 || B=1", 1),
        ("A=7 & ZERO=0", 1),
        ("A | B << 8", 0x307),
        ("1 << 2 + 1", 8),
        ("!A + !ZERO", 1),
        ("- -3", 3),
        ("~5", -6),
        ("A>5?B>5?1:2:3", 2),
        ("ZERO?1:ZERO?2:3", 3),
        ("ZERO=0 ? 0 : 1/ZERO", 0),
        ("ZERO<>0 && 1/ZERO > 2", 0),
        ("SGN(-3)+NEG(4)", -5),
        ("TO / 4.0 * 4", 0),
        ("SEL.Max + 1", 10),
        (" \n A\t+\n1 ", 8),
    ],
)
def test_integer_formulas(text: str, value: int) -> None:
    result = whole(text.replace("TO", "ZERO"))
    assert result == value
    assert isinstance(result, int)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("7/2", 3.5),
        ("A/B", 7 / 3),
        ("2**-1", 0.5),
        ("-7%3", -1.0),
        ("(6|1)/2", 3.5),
        ("1e3+.5+5.", 1005.5),
        ("1.5E-3", 0.0015),
        ("SQRT(2)", math.sqrt(2)),
        ("sqrt(16)", 4.0),
        ("ROUND(2.5)", 3.0),
        ("ROUND(-2.5)", -3.0),
        ("ROUND(2.567,2)", 2.57),
        ("TRUNC(-2.7)", -2.0),
        ("FLOOR(-2.5)+CEIL(-2.5)", -5.0),
        ("LN(E)+LG(1000)", 4.0),
        ("EXP(0)+SIN(0)+COS(0)+TAN(0)", 2.0),
        ("ASIN(1)*2-PI", 0.0),
        ("ACOS(1)+ATAN(1)*4", math.pi),
        ("ATAN2(1,2)", math.atan2(1, 2)),
        ("ABS(-3.5)", 3.5),
        ("1/(2**5000)", 0.0),
    ],
)
def test_float_formulas(text: str, value: float) -> None:
    result = real(text)
    assert result == pytest.approx(value, abs=1e-12)
    assert isinstance(result, float)


@pytest.mark.parametrize(
    ("domain", "text", "words"),
    [
        (WHOLE, "1/ZERO", "division"),
        (WHOLE, "1%ZERO", "division"),
        (WHOLE, "ZERO**-1", "division"),
        (REAL, "1/ZERO", "division"),
        (REAL, "LN(0)", "not defined"),
        (REAL, "SQRT(-1)", "not defined"),
        (REAL, "10.0**308*10", "not finite"),
        (REAL, "1e19 & 1", "64-bit"),
    ],
)
def test_no_result_is_said(domain: Domain, text: str, words: str) -> None:
    with pytest.raises(FeatureRefused, match=words):
        parse_formula(text, domain).evaluate(VARIABLES.get)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "its end"),
        ("1+", "its end"),
        ("(1", "is needed"),
        ("1)", "where it should end"),
        ("1,2", "where it should end"),
        ("1?2", "':' is needed"),
        ("5==5", "where a value is needed"),
        ("FOO(1)", "no function"),
        ("SIN()", "where a value is needed"),
        ("SIN(1,2)", "2 values"),
        ("__import__('os')", "cannot be read"),
        ("X", "nothing defines"),
        ("(" * 5000 + "1" + ")" * 5000, "too deep"),
        ("1+" * 20_000 + "1", "characters"),
    ],
)
def test_what_is_no_formula_is_refused(text: str, words: str) -> None:
    with pytest.raises(FeatureFileInvalid, match=words):
        whole(text)


def test_a_long_sum_is_no_deep_one() -> None:
    assert whole("+".join(["1"] * 5000)) == 5000


PARTS = st.sampled_from(
    [
        *"0123456789.()+-*/%&|^~!=<>?:, ABEe",
        *["**", "<<", ">>", "&&", "||", "0x", "SIN(", "ROUND(", "SEL.Max", "9" * 30, "1e308"],
    ]
)


@given(parts=st.lists(PARTS, max_size=40), domain=st.sampled_from([WHOLE, REAL]))
def test_fuzz_any_formula_has_a_result_or_one_sentence(parts: list[str], domain: Domain) -> None:
    try:
        result = parse_formula("".join(parts), domain).evaluate(VARIABLES.get)
    except FieldcamError as error:
        assert error.message.endswith(".") and "\n" not in error.message
    else:
        assert math.isfinite(result)
        assert isinstance(result, int if domain is WHOLE else float)


@given(a=st.integers(-(2**63), 2**63 - 1), b=st.integers(-(2**63), 2**63 - 1))
def test_integers_stay_within_64_bits(a: int, b: int) -> None:
    values = {"A": a, "B": b}
    for sign in ("+", "-", "*", "&", "|", "^", "<<", ">>"):
        result = parse_formula(f"A {sign} B", WHOLE).evaluate(values.get)
        assert -(2**63) <= result < 2**63
    assert parse_formula("A + B - B", WHOLE).evaluate(values.get) == a
