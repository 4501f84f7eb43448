"""A formula: its text is parsed; then it has values, derivatives and kinks.

The text is cut into pieces: numbers with their units, names, operators, senses. Python's own parser
finds the structure; it evaluates nothing. Dimensions are checked as far as units tell them. A
number without a unit may have any dimension; angles count as numbers.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from math import pi
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions.resolving import (
    OF_ONE,
    TIME,
    Addend,
    Operation,
    Program,
    Sensed,
    Tape,
    Values,
    zeros,
)
from exudyn_flexlink.quantities import (
    DOTS,
    RAISED,
    SPELLINGS,
    UNITS,
    Dimension,
    Powers,
    UnknownUnitError,
    find_unit,
)
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.source import MINUS, HintedError, did_you_mean

LONGEST = 500  # letters of a formula


class ExpressionError(HintedError):
    """A mistake in a formula, in words, with a hint."""


class Token(NamedTuple):
    """A piece: `kind` is number, sensed, name, operator or end; `text` is the user's."""

    kind: str
    text: str
    value: float = 0.0
    powers: Powers | None = None
    sensed: Sensed | None = None

    @property
    def shown(self) -> str:
        """Text of the piece in messages."""
        return "the end" if self.kind == "end" else f"'{self.text}'"


# Words in units. Tonnes are left out: `2 t` is a slip for `2*t`. 'grad' is refused with a hint.
_WORDS = {*UNITS, "Nm", "Nmm", "mNm", "kNm", "grad"} - {"t"}
_SPELT = "|".join([*SPELLINGS, *sorted(_WORDS, key=len, reverse=True)])
_WORD = rf"(?:{_SPELT})(?:[{RAISED}]+(?![\w(])|(?![\w(])(?:\s*\^\s*[0-9])?)"
_NUMBER = r"(?P<value>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
_UNIT = (
    rf"\s*(?P<unit>(?:1(?=/{_WORD})|{_WORD})(?:[ {DOTS}]+{_WORD})*(?:\s*/\s*{_WORD})*)"
    r"(?!\s*[*]{2})"
)
_PIECE = re.compile(
    rf"(?P<number>{_NUMBER}(?:{_UNIT})?)"
    r"|(?P<sensed>(?P<kind>angle|speed|place|force|torque)\s*\((?P<of>[^()]*)\))"
    r"|(?P<name>[^\W\d]\w*)"
    rf"|(?P<operator>\*\*|<=|>=|[-+*/(),<>{MINUS}])"
    r"|(?P<other>\S)"
)
_SLIPS = {
    "^": "powers are written '**'",
    "=": "conditions compare by < or >, and the value is written alone",
    ".": "points stand in place(body.point, x)",
    "[": "there are no lists or keys",
    "'": "names are written without quotes",
    '"': "names are written without quotes",
}


def tokens_of(text: str, words: Sequence[str] = ()) -> Iterator[Token]:
    """Cut a formula into its pieces; the last has the kind end, and `words` are senses.

    Raises:
        ExpressionError: some text is no piece of a formula.

    """
    if len(text) > LONGEST:
        raise ExpressionError(f"an expression of {len(text)} letters; at most {LONGEST}")
    text = text.replace("µ", "u").replace("μ", "u").replace("°", "deg")
    for piece in _PIECE.finditer(text):
        if piece["number"]:
            yield _quantity(piece)
        elif piece["sensed"]:
            yield Token("sensed", piece[0], sensed=_sensed(piece))
        elif piece["name"] in words:
            yield Token("sensed", piece[0], sensed=Sensed(piece[0], ""))
        elif piece["other"]:
            hint = _SLIPS.get(piece[0], "")
            raise ExpressionError(f"'{piece[0]}' can't stand in an expression", hint)
        else:
            kind = "name" if piece["name"] else "operator"
            yield Token(kind, piece[0].replace(MINUS, "-"))
    yield Token("end", "the end")


def _quantity(piece: re.Match[str]) -> Token:
    """Read a number with the unit that may follow it."""
    if piece["unit"] is None:
        return Token("number", piece[0], float(piece["value"]))
    try:
        unit = find_unit(piece["unit"], Dimension.NUMBER)
    except UnknownUnitError as error:
        raise ExpressionError(str(error)) from None
    return Token("number", piece[0], float(piece["value"]) * unit.factor, unit.powers)


def _sensed(piece: re.Match[str]) -> Sensed:
    """Read the text in the brackets of angle, speed, place, force and torque."""
    kind, names = piece["kind"], [name.strip() for name in piece["of"].split(",")]
    if len(names) == 1 and names[0] and not (kind == "place" and "." in names[0]):
        return Sensed(kind, names[0])
    if kind != "place":
        raise ExpressionError(f"'{piece[0]}': expected the name of a joint", f"e.g. {kind}(crank)")
    if len(names) == 2 and names[1] in ("x", "y") and "." in names[0]:
        return Sensed(kind, *names)
    raise ExpressionError(
        f"'{piece[0]}': expected a point and its coordinate, or a joint that slides",
        "e.g. place(rod.end, x) or place(way)",
    )


def unknown_name(name: str, known: list[str]) -> ExpressionError:
    """Return the error for a name that formulas do not know."""
    near = did_you_mean(name, known)
    if name in _WORDS:
        return ExpressionError(
            f"the unit '{name}' follows no number",
            "units stand after numbers, with powers as in '5 m/s^2'",
        )
    return ExpressionError(f"unknown name '{name}'{near}", "there are: " + ", ".join(known))


OF_JOINTS = "force", "torque"
"""Senses that depend on more than the motion."""
RATE = "rate"
"""Word in a spring's formula for the rate of its length, or of its angle."""
DEEPEST = 40  # greatest depth of brackets in brackets
_ARGUMENTS = dict.fromkeys(OF_ONE, 1) | dict.fromkeys(("atan2", "min", "max"), 2) | {"where": 3}
NAMES = ["t", "pi", "angle", "speed", "place", *_ARGUMENTS]
_PURE = Powers()
_IN_WORDS = {dimension.powers._replace(rad=0): dimension.words for dimension in reversed(Dimension)}
_SIGNS = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}
_OPERATIONS = {"+": "add", "-": "sub", "*": "mul", "/": "div", "**": "pow"}
_EXAMPLE = "where(t < 1, one, other)"


class _Piece(NamedTuple):
    """The number of an operation, and its dimension by units; None means any dimension."""

    result: int
    powers: Powers | None


def parse_expression(
    text: str, words: Sequence[str] = (), *, with_forces: bool = False
) -> Expression:
    """Read a formula; its `words` belong to its owner, such as length and rate to a spring.

    Only a formula `with_forces` may sense forces in joints: other formulas determine these forces.

    Raises:
        ExpressionError: the text is no formula, or has more than a formula may have.

    """
    formula = _Reader(text, words).expression()
    for sensed in () if with_forces else formula.sensed:
        if sensed.kind in OF_JOINTS:
            message = f"'{sensed.kind}({sensed.of})' is known in 'run: until' alone"
            raise ExpressionError(message, "here a formula is of t, angles, speeds and places")
    return formula


def looks_like_expression(text: str) -> bool:
    """Tell whether a text is a formula, and more than a number with a unit."""
    try:
        reader = _Reader(text)
        reader.expression()
    except ExpressionError:
        return False
    named = any(token.kind in ("name", "sensed") for token in reader.tokens)
    return named or any(isinstance(node, ast.BinOp) for node in reader.nodes)


def in_words(powers: Powers) -> str:
    """Name a dimension."""
    return _IN_WORDS.get(powers, "another quantity")


def _require_order(tokens: Sequence[Token], known: list[str]) -> None:
    """Refuse pieces in a wrong order, unpaired brackets and unknown names."""
    depth = 0
    for before, token in pairwise((Token("operator", "("), *tokens)):
        value_before = before.kind not in ("operator", "end") or before.text == ")"
        begins_value = token.kind not in ("operator", "end") or token.text == "("
        calls = before.kind == "name" and before.text not in ("t", "pi") and token.text == "("
        if value_before and ((begins_value and not calls) or (token.text == ")" and depth == 0)):
            raise ExpressionError(f"expected an operator before '{token.text}'", "such as + - * /")
        if not value_before and not begins_value and token.text not in ("+", "-"):
            raise ExpressionError(f"expected a number or a name, got {token.shown}")
        depth += (token.text == "(") - (token.text == ")")
        if depth > DEEPEST:
            raise ExpressionError(f"brackets more than {DEEPEST} deep")
    if depth:
        raise ExpressionError("expected ')', got the end")
    for token in tokens:
        if token.kind == "name" and token.text not in ("t", "pi", *_ARGUMENTS):
            raise unknown_name(token.text, known)


class _Reader:
    """Reads Python's tree of a formula, inner nodes first: no depth is too large."""

    def __init__(self, text: str, words: Sequence[str] = ()) -> None:
        self.text = text
        self.tokens = list(tokens_of(text, words))
        _require_order(self.tokens, [*words, "pi", *_ARGUMENTS] if words else NAMES)
        # Replace words by numbered names: these can't be words of Python.
        numbered = (
            token.text if token.kind == "operator" else f"_{i}"
            for i, token in enumerate(self.tokens[:-1])
        )
        self.nodes = list(ast.walk(ast.parse(" ".join(numbered), mode="eval").body))
        self._pieces: dict[ast.AST, _Piece] = {}
        self._sensed = list(dict.fromkeys(token.sensed for token in self.tokens if token.sensed))
        self._tape = Tape()
        self._switches: list[int] = []

    def expression(self) -> Expression:
        for node in reversed(self.nodes):
            formula = self._read(node)
            if formula is not None:
                self._pieces[node] = formula
        result, powers = self._of(self.nodes[0])
        plan = Plan(self._tape, result, self._switches)
        return Expression(self.text, plan, self._sensed, None if powers == _PURE else powers)

    def _read(self, node: ast.AST) -> _Piece | None:
        """Return the piece of a node; None if the node is only a part of another."""
        if isinstance(node, ast.Name):
            return self._atom(self._token(node))
        if isinstance(node, ast.UnaryOp):
            inner = self._of(node.operand)
            return (
                inner if isinstance(node.op, ast.UAdd) else self._piece("neg", inner.powers, inner)
            )
        if isinstance(node, ast.BinOp):
            return self._joined(_SIGNS[type(node.op)], self._of(node.left), self._of(node.right))
        return self._call(node) if isinstance(node, ast.Call) else None

    def _of(self, node: ast.AST) -> _Piece:
        """Return the piece of a node; refuse a node that has no value."""
        if node in self._pieces:
            return self._pieces[node]
        if isinstance(node, ast.Compare):
            raise ExpressionError(f"'{_SIGNS[type(node.ops[0])]}' compares only in where", _EXAMPLE)
        if isinstance(node, ast.Name):
            raise ExpressionError(f"expected '(' after '{self._token(node).text}'")
        hint = "decimals begin with a point, as in 7.85"
        raise ExpressionError("',' parts only what a function takes", hint)

    def _token(self, node: ast.Name) -> Token:
        return self.tokens[int(node.id[1:])]

    def _piece(self, name: str, powers: Powers | None, *taken: _Piece) -> _Piece:
        return _Piece(self._tape.add(name, *(piece.result for piece in taken)), powers)

    def _atom(self, token: Token) -> _Piece | None:
        if token.kind == "number":
            known = None if token.powers is None else token.powers._replace(rad=0)
            return _Piece(self._tape.number(token.value), known)
        if token.sensed is not None:
            return _Piece(self._tape.variable(self._sensed.index(token.sensed)), None)
        if token.text == "t":
            return _Piece(self._tape.variable(TIME), None)
        if token.text == "pi":
            return _Piece(self._tape.number(pi), None)
        return None  # the name of a function

    def _joined(self, sign: str, left: _Piece, right: _Piece) -> _Piece:
        if sign == "**":
            powers = self._raised(left.powers, _pure(right, "an exponent"))
        elif sign in "+-":
            powers = _alike(sign, left, right)
        elif left.powers is None or right.powers is None:
            powers = None
        else:
            way = 1 if sign == "*" else -1
            pairs = zip(left.powers, right.powers, strict=True)
            powers = Powers(*(a + way * b for a, b in pairs))
        return self._piece(_OPERATIONS[sign], powers, left, right)

    def _raised(self, powers: Powers | None, exponent: _Piece) -> Powers | None:
        if powers in (None, _PURE):
            return powers
        number = self._tape.number_of(exponent.result)
        if number is None or not number.is_integer() or abs(number) >= 10:
            return None
        return Powers(*(int(number) * p for p in powers or ()))

    # --- functions ----------------------------------------------------------------------------

    def _call(self, node: ast.Call) -> _Piece:
        assert isinstance(node.func, ast.Name)  # nothing else may stand before '('
        name = self._token(node.func).text
        count = _ARGUMENTS[name]
        if len(node.args) != count:
            raise ExpressionError(f"{name} takes {count} argument{'s' if count > 1 else ''}")
        if name == "where":
            return self._where(*node.args)
        first, *others = map(self._of, node.args)
        if name == "atan2":
            _alike(name, first, *others)
            return self._piece(name, _PURE, first, *others)
        if name in ("min", "max"):
            difference = self._piece("sub", _alike(name, first, *others), *others, first)
            return self._by_sign(
                difference, *((*others, first) if name == "min" else (first, *others))
            )
        return self._of_one(name, first)

    def _of_one(self, name: str, piece: _Piece) -> _Piece:
        if name == "abs" and self._tape.variables(piece.result) - {TIME}:
            return self._by_sign(piece, self._piece("neg", piece.powers, piece), piece)
        if name in ("abs", "sign"):
            self._switches.append(piece.result)
            if name == "sign":
                self._on_time(piece.result, "sign")
            return self._piece(name, piece.powers if name == "abs" else _PURE, piece)
        if name == "sqrt":
            even = piece.powers is not None and all(power % 2 == 0 for power in piece.powers)
            halves = Powers(*(power // 2 for power in piece.powers or ())) if even else None
            return self._piece(name, halves, piece)
        return self._piece(name, _PURE, _pure(piece, name))

    def _by_sign(self, switch: _Piece, negative: _Piece, positive: _Piece) -> _Piece:
        """Choose by the sign of a switch, which is zero where both values are equal."""
        self._switches.append(switch.result)
        below = self._piece("less", _PURE, switch, _Piece(self._tape.number(0.0), _PURE))
        return self._piece("where", switch.powers, below, negative, positive)

    def _where(self, condition: ast.expr, first: ast.expr, second: ast.expr) -> _Piece:
        if not isinstance(condition, ast.Compare) or len(condition.ops) > 1:
            raise ExpressionError("expected a condition in where", _EXAMPLE)
        sign = _SIGNS[type(condition.ops[0])]
        ends = [self._of(condition.left), self._of(condition.comparators[0])]
        switch = self._piece("sub", _alike(sign, *ends), *ends).result
        self._on_time(switch, "where")
        self._switches.append(switch)
        values = [self._of(first), self._of(second)]
        powers = _alike("where", *values)
        # a <= b is "not b < a": at the instant where both are equal it is true.
        if sign in (">", "<="):
            ends.reverse()
        if sign in ("<=", ">="):
            values.reverse()
        return self._piece("where", powers, self._piece("less", _PURE, *ends), *values)

    def _on_time(self, switch: int, name: str) -> None:
        """Refuse a jump that depends on the state."""
        if self._tape.variables(switch) - {TIME}:
            raise ExpressionError(
                f"{name} may depend on t alone: with the state it would jump at no known instant",
                "smooth: tanh(speed(joint)/0.01) in place of sign, or abs, min, max, which only "
                "bend",
            )


# --- dimensions -------------------------------------------------------------------------------


def _pure(piece: _Piece, what: str) -> _Piece:
    """Refuse what is not a number or an angle where it must be."""
    if piece.powers not in (None, _PURE):
        raise ExpressionError(
            f"{what} of {in_words(piece.powers or _PURE)}", "divide by a quantity of its kind"
        )
    return piece


def _alike(what: str, *pieces: _Piece) -> Powers | None:
    """Return the common dimension of pieces; refuse two different ones."""
    known = list(
        dict.fromkeys(piece.powers for piece in pieces if piece.powers not in (None, _PURE))
    )
    if len(known) > 1:
        first, second = (in_words(powers or _PURE) for powers in known)
        raise ExpressionError(f"{first} and {second} can't go together in '{what}'")
    return known[0] if known else _PURE if all(piece.powers for piece in pieces) else None


ORDERS = "value", "derivative", "second derivative"


class NoValueError(Sendable, ArithmeticError):
    """The formula `text` has no value at a time (s), such as a logarithm of a negative number.

    `what` names the missing value; it may be a derivative.
    """

    advice = "mend the expression: min and max, or where(t < 1, one, other), keep it in bounds"

    def __init__(self, text: str, time: float, what: str = "value") -> None:
        super().__init__(f"'{text}' has no {what} at t = {time:.6g} s")
        self.text = text
        self.time = time


class Plan(NamedTuple):
    """The operations behind a `result`, and those at whose zeros it bends."""

    tape: Tape
    result: int
    switches: Sequence[int]


class Expression:
    """A formula of t (s) and of its senses; two formulas are equal if their texts are.

    `powers` is its dimension as far as its units tell; angles count as numbers; None means unknown.
    The state supplies values of `sensed`, in this order. After them may follow a side for each of
    the `kinks` (a number), 1 where the switch is below zero: the formula is held on these sides,
    also beyond a kink. A formula `of_a_place` depends on a single sense and not on time.
    """

    def __init__(
        self, text: str, plan: Plan, sensed: Sequence[Sensed], powers: Powers | None
    ) -> None:
        self.text = text
        self.sensed = tuple(sensed)
        self.of_a_place = plan.tape.variables(plan.result) == {0}
        self.powers = powers
        self._tape, self._result = plan.tape, plan.result
        self._switches = tuple(dict.fromkeys(plan.switches))
        # Comparisons of states belong to max, min or abs; `where` compares only times.
        compared = [
            i
            for i in self._tape.needed([self._result])
            if self._tape.operations[i].name == "less" and self._tape.variables(i) - {TIME}
        ]
        self.kinks = len(compared)
        sides = (Operation("variable", (), len(sensed) + k) for k in range(self.kinks))
        self._held = dict(zip(compared, sides, strict=True))
        switches = [self._tape.operations[i].takes[0] for i in compared]
        self._at_kinks = Program(self._tape, switches, self._held)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Expression) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"

    def __str__(self) -> str:
        return self.text

    @property
    def constant(self) -> float | None:
        """Its value if it is a number; None if it depends on anything."""
        return self._tape.number_of(self._result)

    # --- values -------------------------------------------------------------------------------

    def at(self, time: float, state: Sequence[float] = ()) -> float:
        """Value at a time (s), for values of the senses.

        Raises:
            NoValueError: the formula has no value there.

        """
        return float(self.values(np.array([time]), [np.array([number]) for number in state])[0])

    def values(self, time: FloatArray, state: Sequence[FloatArray]) -> FloatArray:
        """Values (n,) at instants (n,) s, for values (n,) of each sense.

        Raises:
            NoValueError: the formula has no value at one of the instants.

        """
        return self._run_all(self._value, time, state)

    def derivatives(self, time: FloatArray, order: int) -> FloatArray:
        """Derivatives (n,) by time, up to the second, of a formula without senses.

        Raises:
            NoValueError: there is no derivative at one of the instants (n,) s.

        """
        return self._run_all(self._by_time[order], time, what=ORDERS[order])

    def _run_all(
        self,
        program: Program,
        time: FloatArray,
        state: Sequence[FloatArray] = (),
        what: str = "value",
    ) -> FloatArray:
        (values,) = self._values(program, time, state)
        whole = np.broadcast_to(np.asarray(values, dtype=float), np.shape(time))
        missing = np.flatnonzero(~np.isfinite(whole))
        if len(missing):
            raise NoValueError(self.text, float(np.ravel(time)[missing[0]]), what)
        return whole

    def _values(self, program: Program, time: Values, state: Sequence[Values]) -> list[Values]:
        values = program.run(time, state)
        if len(state) > len(self.sensed) and not np.isfinite(sum(values)).all():
            # Beyond its kink a held formula may have no value, such as a root.
            unheld = program.run(time, state[: len(self.sensed)])
            values = [np.where(np.isfinite(x), x, y) for x, y in zip(values, unheld, strict=True)]
        return values

    @cached_property
    def _value(self) -> Program:
        return Program(self._tape, [self._result], self._held)

    @cached_property
    def _by_time(self) -> list[Program]:
        first = self._tape.slope(self._result)
        second = self._tape.slope(first)
        return [self._value, *(Program(self._tape, [formula]) for formula in (first, second))]

    @cached_property
    def whole(self) -> Addend:
        """The whole formula as one term, not held on sides of its kinks."""
        return Addend(self._tape, self._result)

    @cached_property
    def addends(self) -> list[Addend]:
        """The terms whose sum is the formula."""
        return self._addends_of(self._result)

    @cached_property
    def rate_addends(self) -> list[Addend]:
        """The terms of the formula's first derivative by time."""
        return self._addends_of(self._tape.slope(self._result))

    def _addends_of(self, result: int) -> list[Addend]:
        addends, left = [], [result]
        while left:
            term = left.pop()
            name, takes, _ = self._tape.operations[term]
            if name in ("add", "sub", "neg"):
                left += takes
            elif self._tape.variables(term):
                addends.append(Addend(self._tape, term, self._held))
        return addends

    def along(self, start: float, way: float) -> Expression:
        """Return a formula of a place, with ``start + way t`` in place of the place."""
        tape = Tape()
        moved = tape.add("mul", tape.number(way), tape.variable(TIME))
        of = {self._tape.variable(0): tape.add("add", tape.number(start), moved)}
        for i in self._tape.needed([self._result, *self._switches]):
            name, takes, value = self._tape.operations[i]
            if name == "number":
                of[i] = tape.number(value)
            elif name != "variable":
                of[i] = tape.add(name, *(of[k] for k in takes))
        plan = Plan(tape, of[self._result], [of[i] for i in self._switches])
        return Expression(self.text, plan, (), self.powers)

    # --- bends --------------------------------------------------------------------------------

    def switches(self, time: FloatArray, state: Sequence[FloatArray]) -> FloatArray:
        """Values (kinks, n) that are zero at the kinks, by time and state as `values`."""
        values = self._values(self._at_kinks, time, state)
        return np.array([np.broadcast_to(value, np.shape(time)) for value in values])

    @cached_property
    def linear_bends(self) -> list[float]:
        """Instants (s) at which a condition that is linear in t changes, in order."""
        instants = []
        for switch in self._of_time:
            rate = self._tape.number_of(self._tape.slope(switch))
            if rate:
                instants.append(-float(Program(self._tape, [switch]).run(0.0)[0]) / rate)
        return sorted(instants)

    def bends(self, begin: float, end: float) -> list[float]:
        """Instants (s) between two at which a condition of time alone changes, in order."""
        instants = set(self.linear_bends)
        for switch in self._of_time:
            if self._tape.number_of(self._tape.slope(switch)) is None:
                instants.update(zeros(Addend(self._tape, switch), begin, end).tolist())
        return sorted(time for time in instants if begin < time < end)

    @property
    def _of_time(self) -> list[int]:
        return [switch for switch in self._switches if self._tape.variables(switch) == {TIME}]
