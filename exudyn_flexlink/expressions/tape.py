"""Operations one after the other: what a formula computes, and its exact time derivatives.

Every operation takes results of earlier ones, so that a formula is a list of them and the number of
its last. Equal operations are kept once: derivatives share what they have in common, and grow with
the formula, not with its powers. A result that is no number, such as the root of a negative one, is
NaN, and may still be left out by a `where`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray

Values = float | FloatArray

TIME = -1
"""The variable t; those of the state count from 0."""
RATES = 1000
"""So much further on counts the time derivative of a variable of the state."""


@dataclass(frozen=True)
class Sensed:
    """What a formula takes of the state: `angle`, `speed` or `place` of a joint, or of a point.

    `of` is the joint, or the point 'body.point' of which `axis` is the coordinate 'x' or 'y'. The
    place of a joint is how far it is out.
    """

    kind: str
    of: str
    axis: str = ""


class Operation(NamedTuple):
    """Its name, the operations whose results it takes, and the value of a number or variable."""

    name: str
    takes: tuple[int, ...] = ()
    value: float = 0.0


def _less(a: Values, b: Values) -> FloatArray:
    return np.where(np.isnan(np.add(a, b)), np.nan, np.less(a, b).astype(float))


def _where(condition: Values, one: Values, other: Values) -> FloatArray:
    return np.where(np.isnan(condition), np.nan, np.where(condition, one, other))


OF_ONE = ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sqrt", "abs", "tanh", "sign")
"""Functions of one number."""
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in (*OF_ONE, "atan2", "pow")},
    "neg": np.negative,
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "less": _less,
    "where": _where,
}

# Operations with a number that change nothing. Zero times anything is zero, but for what never has
# a value; zero by anything is not, for that may be zero, too.
_KEEP_FIRST = (("add", 0), ("sub", 0), ("mul", 1), ("div", 1), ("pow", 1))
_KEEP_LAST = (("add", 0), ("mul", 1))


class Program:
    """Computes some results of a tape, from the time and the state.

    Operations that are `held` are variables, if the state goes so far, and else as others are.
    """

    def __init__(
        self, tape: Tape, results: Sequence[int], held: Mapping[int, Operation] | None = None
    ) -> None:
        held, needed = held or {}, tape.needed(results)
        self.plan = [(i, held.get(i, tape.operations[i])) for i in needed]
        self._held = [(i, int(one.value)) for i, one in held.items()]
        self._results = tuple(results)
        self._numbers: dict[int, Values] = {}
        self._variables: list[tuple[int, int]] = []
        self._steps: list[tuple[int, Callable[..., Any], tuple[int, ...]]] = []
        for i in needed:
            name, takes, value = tape.operations[i]
            if name == "number":
                self._numbers[i] = value
            elif name == "variable":
                self._variables.append((i, int(value)))
            else:
                self._steps.append((i, FUNCTIONS[name], takes))
        self._free = [step for step in self._steps if step[0] not in held]

    def run(self, t: Values, state: Sequence[Values] = ()) -> list[Values]:
        """Return the results, of instants and states alike in shape; no number where none is."""
        values = self._numbers.copy()
        for i, which in self._variables:
            values[i] = t if which == TIME else state[which]
        steps = self._steps
        if self._held and len(state) > self._held[0][1]:
            values.update((i, state[which]) for i, which in self._held)
            steps = self._free
        with np.errstate(all="ignore"):
            for i, function, takes in steps:
                values[i] = function(*map(values.__getitem__, takes))
        return [values[i] for i in self._results]


class Tape:
    """Operations in order; adds only what is new, and simpler where a number is known."""

    def __init__(self) -> None:
        self.operations: list[Operation] = []
        self._known: dict[Operation, int] = {}
        self._slopes: dict[int, int] = {}  # time derivatives, by operation

    def number(self, value: float) -> int:
        """Add a number."""
        return self._kept(Operation("number", (), value + 0.0))

    def variable(self, which: int) -> int:
        """Add t (`TIME`) or a variable of the state."""
        return self._kept(Operation("variable", (), which))

    def add(self, name: str, *takes: int) -> int:
        """Add an operation."""
        numbers = [self.number_of(i) for i in takes]
        known = [x for x in numbers if x is not None]
        if len(known) == len(takes):
            with np.errstate(all="ignore"):  # what is no number is told by its user
                value = float(FUNCTIONS[name](*known))
            if math.isfinite(value):
                return self.number(value)
            return self._kept(Operation(name, takes))  # such as 0/0
        same = self._simpler(name, takes, numbers)
        return self._kept(Operation(name, takes)) if same is None else same

    def number_of(self, i: int) -> float | None:
        """Return the value of an operation that is a number; None if it is none."""
        operation = self.operations[i]
        return operation.value if operation.name == "number" else None

    def needed(self, results: Sequence[int]) -> list[int]:
        """Return the operations behind some results, in order."""
        found = set(results)
        for i in range(max(results, default=-1), -1, -1):
            if i in found:
                found.update(self.operations[i].takes)
        return sorted(found)

    def variables(self, result: int) -> set[int]:
        """Return the variables that a result depends on."""
        behind = (self.operations[i] for i in self.needed([result]))
        return {int(one.value) for one in behind if one.name == "variable"}

    def slope(self, result: int) -> int:
        """Add the derivative of a result by time."""
        for i in self.needed([result]):
            if i not in self._slopes:
                self._slopes[i] = self._slope_of(i)
        return self._slopes[result]

    # --- inner --------------------------------------------------------------------------------

    def _kept(self, operation: Operation) -> int:
        if operation not in self._known:
            self._known[operation] = len(self.operations)
            self.operations.append(operation)
        return self._known[operation]

    def _simpler(
        self, name: str, takes: tuple[int, ...], numbers: Sequence[float | None]
    ) -> int | None:
        """Return what comes to the same with less work; None if nothing does."""
        first, last = numbers[0], numbers[-1]
        left, right = takes[0], takes[-1]
        found: int | None = None
        if (name, last) in _KEEP_FIRST or (name == "where" and takes[1] == takes[2]):
            found = left if name != "where" else right
        elif (name, first) in _KEEP_LAST:
            found = right
        elif name == "mul" and 0 in (first, last):
            other = right if first == 0 else left
            known = self.number_of(other) is not None or self.variables(other)
            found = self.number(0.0) if known else None
        elif (name, first) == ("sub", 0):
            found = self.add("neg", right)
        elif (name, last) == ("pow", 0):
            found = self.number(1.0)
        elif name == "neg" and self.operations[left].name == "neg":
            found = self.operations[left].takes[0]
        return found

    def _slope_of(self, i: int) -> int:
        name, takes, value = self.operations[i]
        if name == "number":
            return self.number(0.0)
        if name == "variable":
            return self.number(1.0) if value == TIME else self.variable(int(value) + RATES)
        inner = [self._slopes[k] for k in takes]
        if all(self.number_of(k) == 0 for k in inner):
            return self.number(0.0)
        return self._by_rule(name, i, takes, inner)

    def _by_rule(self, name: str, i: int, takes: tuple[int, ...], inner: list[int]) -> int:
        """Apply the rule of an operation to the slopes of what it takes."""
        if name in ("neg", "add", "sub"):
            return self.add(name, *inner)
        if name == "where":
            return self.add("where", takes[0], *inner[1:])
        if name in ("sign", "less"):
            return self.number(0.0)
        if name in ("mul", "div", "pow", "atan2"):
            return self._of_two(name, i, takes, inner)
        return self.add("mul", self._of_one(name, i, takes[0]), inner[0])

    def _of_one(self, name: str, i: int, a: int) -> int:
        """Slope of a function of one number, which is result i, at a."""
        one, two = self.number(1.0), self.number(2.0)
        if name in ("asin", "acos"):
            root = self.add("sqrt", self.add("sub", one, self.add("mul", a, a)))
            return self.add("div", self.number(1.0 if name == "asin" else -1.0), root)
        slopes: dict[str, Callable[[], int]] = {
            "sin": lambda: self.add("cos", a),
            "cos": lambda: self.add("neg", self.add("sin", a)),
            "tan": lambda: self.add("add", one, self.add("mul", i, i)),
            "atan": lambda: self.add("div", one, self.add("add", one, self.add("mul", a, a))),
            "exp": lambda: i,
            "log": lambda: self.add("div", one, a),
            "sqrt": lambda: self.add("div", one, self.add("mul", two, i)),
            "tanh": lambda: self.add("sub", one, self.add("mul", i, i)),
            "abs": lambda: self.add("sign", a),
        }
        return slopes[name]()

    def _of_two(self, name: str, i: int, takes: tuple[int, ...], inner: list[int]) -> int:
        (a, b), (da, db) = takes, inner
        mul, add, sub, div = (partial(self.add, name) for name in ("mul", "add", "sub", "div"))
        if name == "mul":
            return add(mul(da, b), mul(a, db))
        if name == "div":
            return div(sub(da, mul(i, db)), b)
        if name == "atan2":
            return div(sub(mul(b, da), mul(a, db)), add(mul(a, a), mul(b, b)))
        of_base = mul(mul(b, self.add("pow", a, sub(b, self.number(1.0)))), da)
        if self.number_of(db) == 0:
            return of_base
        of_exponent = mul(mul(i, self.add("log", a)), db)
        return of_exponent if self.number_of(da) == 0 else add(of_base, of_exponent)
