"""Formulas of SwissKnife and Converter nodes: a tokenizer and a precedence parser.

Operators bind as in C, with `**` above `*`, all from the left. The standard's
reference implementation has fewer levels (`A = 1 || B = 1` is `((A = 1) || B) = 1`
there), but of 25,000 formulas in 113 cameras' files the 8 that differ all mean
what C says. What a branch that is not taken contains is not evaluated, so that
`(N = 0) ? 0 : (1 / N)` holds for every N.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

from fieldcam.camera.genapi.arithmetic import (
    BINARY,
    CONSTANTS,
    FUNCTIONS,
    UNARY,
    Number,
    nearest_int,
    to_finite,
    to_int,
    wrap,
)
from fieldcam.errors import FeatureFileInvalid, FeatureRefused
from fieldcam.foreign.bounds import LONGEST_FORMULA

LEVELS: tuple[frozenset[str], ...] = (
    frozenset({"||"}),
    frozenset({"&&"}),
    frozenset({"|"}),
    frozenset({"^"}),
    frozenset({"&"}),
    frozenset({"=", "<>"}),
    frozenset({"<", ">", "<=", ">="}),
    frozenset({"<<", ">>"}),
    frozenset({"+", "-"}),
    frozenset({"*", "/", "%"}),
    frozenset({"**"}),
)
"""Binary operators, the loosest first."""

BINDING = {sign: level for level, signs in enumerate(LEVELS) for sign in signs}

_TOKEN = re.compile(
    r"\s*(?:(?P<hexadecimal>0[xX][0-9A-Fa-f]+)"
    r"|(?P<decimal>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_.]*)"
    r"|(?P<sign>\*\*|<<|>>|<=|>=|<>|&&|\|\||[-+*/%&|^~!=<>?:(),]))"
)

Lookup = Callable[[str], Number | None]
"""Gives a variable's value; None where the formula's node knows no such name."""


class Term(Protocol):
    """A part of a formula."""

    def evaluate(self, lookup: Lookup) -> Number: ...


@dataclass(frozen=True, slots=True)
class Literal:
    value: Number

    def evaluate(self, lookup: Lookup) -> Number:
        return self.value


@dataclass(frozen=True, slots=True)
class Variable:
    name: str

    def evaluate(self, lookup: Lookup) -> Number:
        value = lookup(self.name)
        if value is None:
            value = CONSTANTS.get(self.name.upper())
        if value is None:
            raise FeatureFileInvalid(f"A formula uses {self.name}, which nothing defines.")
        return value


@dataclass(frozen=True, slots=True)
class Call:
    function: Callable[..., Number]
    arguments: tuple[Term, ...]

    def evaluate(self, lookup: Lookup) -> Number:
        return self.function(*(argument.evaluate(lookup) for argument in self.arguments))


@dataclass(frozen=True, slots=True)
class Chain:
    """Operators of one level from left to right; a chain, so that long sums nest nothing."""

    first: Term
    rest: tuple[tuple[Callable[[Number, Number], Number], Term], ...]

    def evaluate(self, lookup: Lookup) -> Number:
        value = self.first.evaluate(lookup)
        for operate, term in self.rest:
            value = operate(value, term.evaluate(lookup))
        return value


@dataclass(frozen=True, slots=True)
class Logic:
    """`||`, or `&&`, between terms: the first one that settles it ends it."""

    settled_by: bool
    terms: tuple[Term, ...]

    def evaluate(self, lookup: Lookup) -> Number:
        for term in self.terms:
            if bool(term.evaluate(lookup)) == self.settled_by:
                return int(self.settled_by)
        return int(not self.settled_by)


@dataclass(frozen=True, slots=True)
class Conditional:
    """`condition ? value : condition ? value : … otherwise`."""

    cases: tuple[tuple[Term, Term], ...]
    otherwise: Term

    def evaluate(self, lookup: Lookup) -> Number:
        for condition, value in self.cases:
            if condition.evaluate(lookup):
                return value.evaluate(lookup)
        return self.otherwise.evaluate(lookup)


@dataclass(frozen=True, slots=True)
class Domain:
    """What a formula counts in."""

    literal: Callable[[Number], Number]
    variable: Callable[[Number], Number]
    result: Callable[[Number], Number]


WHOLE = Domain(literal=lambda value: value, variable=nearest_int, result=to_int)
"""Of integer nodes: 64-bit integers; fractions of the result are cut off."""
REAL = Domain(literal=float, variable=float, result=float)
"""Of float nodes: every number is a float."""


@dataclass(frozen=True, slots=True)
class Formula:
    """A parsed formula."""

    text: str
    term: Term
    domain: Domain

    def evaluate(self, lookup: Lookup) -> Number:
        """An int in WHOLE, a finite float in REAL.

        Raises FeatureRefused where the variables' values allow no result, and
        FeatureFileInvalid for a name that nothing defines.
        """

        def variable(name: str) -> Number | None:
            value = lookup(name)
            return None if value is None else self.domain.variable(value)

        try:
            return self.domain.result(to_finite(self.term.evaluate(variable)))
        except ArithmeticError as error:
            raise FeatureRefused(
                f"The camera's formula {_shortened(self.text)} has no result: {error}."
            ) from error


def parse_formula(text: str, domain: Domain) -> Formula:
    """Parse one formula.

    Raises FeatureFileInvalid.
    """
    if len(text) > LONGEST_FORMULA:
        raise FeatureFileInvalid(f"A formula has {len(text)} characters.")
    parser = _Parser(text, domain)
    try:
        return Formula(text, parser.parse(), domain)
    except RecursionError as error:
        raise parser.refuse("is nested too deep") from error


def _shortened(text: str) -> str:
    plain = " ".join(text.split())
    return plain if len(plain) <= 80 else f"{plain[:79]}…"


class _Parser:
    """Precedence climbing over the tokens of one formula."""

    def __init__(self, text: str, domain: Domain) -> None:
        self._text = text
        self._literal = domain.literal
        self._tokens = self._tokenize()
        self._advance()

    def parse(self) -> Term:
        term = self._choice()
        if self._kind:
            raise self.refuse(f"has {self._token!r} where it should end")
        return term

    def refuse(self, complaint: str) -> FeatureFileInvalid:
        return FeatureFileInvalid(f"The formula {_shortened(self._text)!r} {complaint}.")

    def _tokenize(self) -> Iterator[tuple[str, str]]:
        place, end = 0, len(self._text.rstrip())
        while place < end:
            found = _TOKEN.match(self._text, place)
            if found is None:
                raise self.refuse(f"cannot be read at {self._text[place:][:10].strip()!r}")
            kind = found.lastgroup or ""
            yield kind, found[kind]
            place = found.end()

    def _advance(self) -> None:
        self._kind, self._token = next(self._tokens, ("", ""))

    def _take(self, sign: str) -> bool:
        """Whether the next token is this sign, which is then consumed."""
        if self._kind != "sign" or self._token != sign:
            return False
        self._advance()
        return True

    def _expect(self, sign: str) -> None:
        if not self._take(sign):
            raise self.refuse(f"has {self._token or 'its end'!r} where {sign!r} is needed")

    def _choice(self) -> Term:
        cases: list[tuple[Term, Term]] = []
        while True:
            term = self._binary(0)
            if not self._take("?"):
                return Conditional(tuple(cases), term) if cases else term
            value = self._choice()
            self._expect(":")
            cases.append((term, value))

    def _binary(self, loosest: int) -> Term:
        """An operand, and all operators behind it that bind at least as tight as this level."""
        term = self._unary()
        while self._kind == "sign" and BINDING.get(self._token, -1) >= loosest:
            term = self._chain(term, BINDING[self._token])
        return term

    def _chain(self, first: Term, level: int) -> Term:
        rest: list[tuple[str, Term]] = []
        while self._kind == "sign" and self._token in LEVELS[level]:
            sign = self._token
            self._advance()
            rest.append((sign, self._binary(level + 1)))
        if rest[0][0] in ("||", "&&"):
            return Logic(rest[0][0] == "||", (first, *(term for _, term in rest)))
        return Chain(first, tuple((BINARY[sign], term) for sign, term in rest))

    def _unary(self) -> Term:
        if self._kind == "sign" and self._token in UNARY:
            function = UNARY[self._token]
            self._advance()
            return Call(function, (self._unary(),))
        return self._primary()

    def _primary(self) -> Term:
        kind, token = self._kind, self._token
        if self._take("("):
            term = self._choice()
            self._expect(")")
            return term
        self._advance()
        if kind == "hexadecimal":
            return Literal(self._literal(wrap(int(token, 16))))
        if kind == "decimal":
            whole = token.isdigit() and len(token) < 20
            return Literal(self._literal(wrap(int(token)) if whole else float(token)))
        if kind == "name":
            return self._call(token) if self._take("(") else Variable(token)
        raise self.refuse(f"has {token or 'its end'!r} where a value is needed")

    def _call(self, name: str) -> Term:
        if name.upper() not in FUNCTIONS:
            raise self.refuse(f"uses {name}, which is no function")
        function, least, most = FUNCTIONS[name.upper()]
        arguments = [self._choice()]
        while self._take(","):
            arguments.append(self._choice())
        self._expect(")")
        if not least <= len(arguments) <= most:
            raise self.refuse(f"gives {name} {len(arguments)} values")
        return Call(function, tuple(arguments))
