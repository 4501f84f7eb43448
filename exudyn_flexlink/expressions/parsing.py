"""Reads a formula; nothing of Python is evaluated.

    sum       = product (("+" | "-") product)*
    product   = factor (("*" | "/") factor)*
    factor    = "-" factor | power
    power     = atom ["**" factor]
    atom      = number [unit] | "t" | "pi" | sensed | function "(" sum ("," sum)* ")" | "(" sum ")"
    condition = sum ("<" | "<=" | ">" | ">=") sum,  the first argument of where

Dimensions are checked as far as units tell: a number without a unit may stand for anything, and
angles count as numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from exudyn_flexlink.expressions.expression import Expression, Plan
from exudyn_flexlink.expressions.tape import TIME, Tape
from exudyn_flexlink.expressions.tokens import (
    ExpressionError,
    Sensed,
    Token,
    tokens_of,
    unknown_name,
)
from exudyn_flexlink.units import Dimension, Powers

DEEPEST = 40  # brackets in brackets
_OF_ONE = ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sqrt", "abs", "tanh", "sign")
_ARGUMENTS = dict.fromkeys(_OF_ONE, 1) | dict.fromkeys(("atan2", "min", "max"), 2) | {"where": 3}
NAMES = ["t", "pi", "angle", "speed", "place", *_ARGUMENTS]
PI = 3.141592653589793
_PURE = Powers()
_IN_WORDS = {one.powers._replace(rad=0): one.words for one in reversed(Dimension)}


class _Piece(NamedTuple):
    """The number of an operation, and the dimension that units give it; None: anything."""

    result: int
    powers: Powers | None


def parse_expression(text: str) -> Expression:
    """Read a formula.

    Raises:
        ExpressionError: it is none, or has more than a formula may have.

    """
    return _Parser(text).expression()


def looks_like_expression(text: str) -> bool:
    """Tell whether a text is a formula, and more than a number with a unit."""
    try:
        found = _Parser(text)
        found.expression()
    except ExpressionError:
        return False
    return found.operations > 0


def in_words(powers: Powers) -> str:
    """Name a dimension."""
    return _IN_WORDS.get(powers, "another quantity")


class _Parser:
    """Reads by descending from sums to atoms; `operations` counts what joins or takes numbers."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.operations = 0
        self._tokens: Sequence[Token] = list(tokens_of(text))
        self._next = 0
        self._depth = 0
        self._tape = Tape()
        self._sensed: list[Sensed] = []
        self._switches: list[int] = []

    def expression(self) -> Expression:
        found = self._sum()
        left = self._token
        if left.kind == "operator" and left.text in "<>=":
            raise ExpressionError(
                f"'{left.text}' compares only in where", "where(t < 1, one, other)"
            )
        if left.kind != "end":
            raise ExpressionError(f"expected an operator before '{left.text}'", "such as + - * /")
        powers = None if found.powers == _PURE else found.powers
        plan = Plan(self._tape, found.result, self._switches)
        return Expression(self.text, plan, self._sensed, powers)

    # --- pieces -------------------------------------------------------------------------------

    @property
    def _token(self) -> Token:
        return self._tokens[self._next]

    def _taken(self, *operators: str) -> str:
        """Take the next token if it is one of these operators; else return nothing."""
        token = self._token
        if token.kind != "operator" or token.text not in operators:
            return ""
        self._next += 1
        return token.text

    def _require(self, operator: str) -> None:
        if not self._taken(operator):
            raise ExpressionError(f"expected '{operator}', got {self._here()}")

    def _here(self) -> str:
        return "the end" if self._token.kind == "end" else f"'{self._token.text}'"

    # --- grammar ------------------------------------------------------------------------------

    def _sum(self) -> _Piece:
        found = self._product()
        while operator := self._taken("+", "-"):
            found = self._added("add" if operator == "+" else "sub", found, self._product())
        return found

    def _product(self) -> _Piece:
        found = self._factor()
        while operator := self._taken("*", "/"):
            name = "mul" if operator == "*" else "div"
            found = self._multiplied(name, found, self._factor())
        return found

    def _factor(self) -> _Piece:
        """Read signs one after the other: each would else go deeper."""
        negative = False
        while sign := self._taken("-", "+"):
            negative ^= sign == "-"
        found = self._power()
        return _Piece(self._tape.add("neg", found.result), found.powers) if negative else found

    def _power(self) -> _Piece:
        base = self._atom()
        if not self._taken("**"):
            return base
        self.operations += 1
        self._deeper()
        exponent = self._pure(self._factor(), "an exponent")
        self._depth -= 1
        number = self._tape.number_of(exponent)
        powers = base.powers
        if powers not in (None, _PURE):
            whole = number is not None and number.is_integer() and abs(number) < 10
            powers = Powers(*(int(number or 0) * p for p in powers or ())) if whole else None
        return _Piece(self._tape.add("pow", base.result, exponent), powers)

    def _deeper(self) -> None:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ExpressionError(f"brackets or powers more than {DEEPEST} deep")

    def _atom(self) -> _Piece:
        token = self._token
        self._next += token.kind != "end"
        if token.kind == "number":
            known = None if token.powers is None else token.powers._replace(rad=0)
            return _Piece(self._tape.number(token.value), known)
        if token.sensed is not None:
            return self._of_state(token.sensed)
        if token.kind == "name":
            return self._named(token.text)
        if token.text == "(":
            self._deeper()
            found = self._sum()
            self._require(")")
            self._depth -= 1
            return found
        self._next -= token.kind != "end"
        raise ExpressionError(f"expected a number or a name, got {self._here()}")

    def _of_state(self, sensed: Sensed) -> _Piece:
        self.operations += 1
        if sensed not in self._sensed:
            self._sensed.append(sensed)
        return _Piece(self._tape.variable(self._sensed.index(sensed)), None)

    def _named(self, name: str) -> _Piece:
        self.operations += 1
        if name == "t":
            return _Piece(self._tape.variable(TIME), None)
        if name == "pi":
            return _Piece(self._tape.number(PI), None)
        if name not in _ARGUMENTS:
            raise unknown_name(name, NAMES)
        self._require("(")
        self._deeper()
        found = self._where() if name == "where" else self._call(name)
        self._depth -= 1
        return found

    # --- functions ----------------------------------------------------------------------------

    def _call(self, name: str) -> _Piece:
        taken = [self._sum()]
        while self._taken(","):
            taken.append(self._sum())
        self._close(name, len(taken))
        if name == "atan2":
            self._same(name, *taken)
            return _Piece(self._tape.add(name, *(piece.result for piece in taken)), _PURE)
        if name in ("min", "max"):
            one, other = taken
            self._same(name, one, other)
            switch = self._tape.add("sub", other.result, one.result)
            self._switches.append(switch)
            least = self._tape.add("less", switch, self._tape.number(0.0))
            swapped = (other, one) if name == "min" else (one, other)
            results = (piece.result for piece in swapped)
            return _Piece(self._tape.add("where", least, *results), one.powers or other.powers)
        return self._of_one(name, taken[0])

    def _of_one(self, name: str, taken: _Piece) -> _Piece:
        if name == "abs" and self._tape.variables(taken.result) - {TIME}:
            self._switches.append(taken.result)
            negative = self._tape.add("less", taken.result, self._tape.number(0.0))
            either = self._tape.add("neg", taken.result), taken.result
            return _Piece(self._tape.add("where", negative, *either), taken.powers)
        if name in ("abs", "sign"):
            self._switches.append(taken.result)
            if name == "sign":
                self._on_time(taken.result, "sign")
            powers = taken.powers if name == "abs" else _PURE
            return _Piece(self._tape.add(name, taken.result), powers)
        if name == "sqrt":
            powers = taken.powers
            if powers is not None:
                even = all(power % 2 == 0 for power in powers)
                powers = Powers(*(power // 2 for power in powers)) if even else None
            return _Piece(self._tape.add(name, taken.result), powers)
        return _Piece(self._tape.add(name, self._pure(taken, name)), _PURE)

    def _where(self) -> _Piece:
        left = self._sum()
        operator = self._taken("<", "<=", ">", ">=")
        if not operator:
            raise ExpressionError(
                f"expected a condition in where, got {self._here()}", "where(t < 1, one, other)"
            )
        right = self._sum()
        self._same(operator, left, right)
        switch = self._tape.add("sub", left.result, right.result)
        self._on_time(switch, "where")
        self._switches.append(switch)
        self._require(",")
        one = self._sum()
        self._require(",")
        other = self._sum()
        self._close("where", 3)
        self._same("where", one, other)
        first, second = one.result, other.result
        ends = (left.result, right.result)
        # a <= b is not b < a: at the very instant it counts as true.
        if operator in (">", "<="):
            ends = ends[::-1]
        if operator in ("<=", ">="):
            first, second = second, first
        condition = self._tape.add("less", *ends)
        return _Piece(self._tape.add("where", condition, first, second), one.powers or other.powers)

    def _close(self, name: str, count: int) -> None:
        if self._token.text == "," or count != _ARGUMENTS[name]:
            number = _ARGUMENTS[name]
            raise ExpressionError(f"{name} takes {number} argument{'s' if number > 1 else ''}")
        self._require(")")

    def _on_time(self, switch: int, name: str) -> None:
        """Refuse a jump with the state."""
        if self._tape.variables(switch) - {TIME}:
            raise ExpressionError(
                f"{name} may depend on t alone: with the state it would jump at no known instant",
                "smooth: tanh(speed(joint)/0.01) in place of sign, or abs, min, max, which only "
                "bend",
            )

    # --- dimensions ---------------------------------------------------------------------------

    def _pure(self, piece: _Piece, what: str) -> int:
        """Refuse what is not a number or an angle where it must be."""
        if piece.powers not in (None, _PURE):
            raise ExpressionError(
                f"{what} of {in_words(piece.powers or _PURE)}", "divide by a quantity of its kind"
            )
        return piece.result

    def _same(self, what: str, one: _Piece, other: _Piece) -> None:
        known = [p for p in (one.powers, other.powers) if p not in (None, _PURE)]
        if len(set(known)) > 1:
            first, second = (in_words(p or _PURE) for p in known)
            raise ExpressionError(f"{first} and {second} can't go together in '{what}'")

    def _added(self, name: str, one: _Piece, other: _Piece) -> _Piece:
        self.operations += 1
        self._same("+" if name == "add" else "-", one, other)
        known = [p for p in (one.powers, other.powers) if p not in (None, _PURE)]
        pure = _PURE if one.powers == other.powers == _PURE else None
        return _Piece(self._tape.add(name, one.result, other.result), known[0] if known else pure)

    def _multiplied(self, name: str, one: _Piece, other: _Piece) -> _Piece:
        self.operations += 1
        powers = None
        if one.powers is not None and other.powers is not None:
            way = 1 if name == "mul" else -1
            pairs = zip(one.powers, other.powers, strict=True)
            powers = Powers(*(a + way * b for a, b in pairs))
        return _Piece(self._tape.add(name, one.result, other.result), powers)
