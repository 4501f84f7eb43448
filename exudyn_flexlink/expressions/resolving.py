"""Formulas as lists of operations: their values, derivatives and bounds, and zeros in time.

Bounds tell where a function of time is zero or has a pole, and how finely it must be sampled.
Values at instants may miss a short pulse. So parts of a time are halved until interval arithmetic
decides. In a short part a term f is a polynomial of degree n, except for the remainder of
interpolation at Chebyshev points, ``(w/4)^n (max f^(n) - min f^(n)) / n!`` in a part of width w.

Interval arithmetic (R. E. Moore, *Interval Analysis*, 1966): every operation computes bounds from
the bounds of its operands. They may be wider than the formula's range, if an operand occurs twice,
but never narrower, except by rounding. Bounds are pairs of arrays of the same shape, or of numbers.

A `Tape` has the operations of a formula, and of its exact time derivatives, in a row. The operands
of an operation are results of earlier ones. So a formula is a list of operations and the number of
the last. Equal operations are kept once. So derivatives share common operations and grow in
proportion to the formula. A result that is no number, such as the root of a negative number, is
NaN; a `where` may still skip it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import factorial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.rounding import LAST_PLACES, SUM_ROUNDING

Values = float | FloatArray

TIME = -1
"""The variable t; those of the state count from 0."""
RATES = 1000
"""Number of the time derivative of a variable of the state, minus that of the variable."""


@dataclass(frozen=True)
class Sensed:
    """A sense of a formula: `angle`, `speed` or `place` of a joint, or the place of a point.

    `of` is the joint, or the point 'body.point' of which `axis` is the coordinate 'x' or 'y'. The
    place of a joint is the stroke of a slide.
    """

    kind: str
    of: str
    axis: str = ""


class Operation(NamedTuple):
    """Name, numbers of the operations that are its operands, and value of a number or variable."""

    name: str
    takes: tuple[int, ...] = ()
    value: float = 0.0


def _less(a: Values, b: Values) -> FloatArray:
    return np.where(np.isnan(np.add(a, b)), np.nan, np.less(a, b).astype(float))


def _where(condition: Values, chosen: Values, otherwise: Values) -> FloatArray:
    return np.where(np.isnan(condition), np.nan, np.where(condition, chosen, otherwise))


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

# Operations with a number that change nothing. Zero times an operand is zero, unless it never has a
# value. Zero divided by an operand is not always zero, since the operand may be zero, too.
_KEEP_FIRST = (("add", 0), ("sub", 0), ("mul", 1), ("div", 1), ("pow", 1))
_KEEP_LAST = (("add", 0), ("mul", 1))


class Program:
    """Computes some results of a tape, from the time and the state.

    `held` operations are variables if the state has values for them; otherwise they are computed.
    """

    def __init__(
        self, tape: Tape, results: Sequence[int], held: Mapping[int, Operation] | None = None
    ) -> None:
        held, needed = held or {}, tape.needed(results)
        self.plan = [(i, held.get(i, tape.operations[i])) for i in needed]
        self._held = [(i, int(operation.value)) for i, operation in held.items()]
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
        """Return the results, in the shape of instants and states; NaN without a value."""
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
    """Operations in order; adds only new ones, simplified if an operand is a known number."""

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
            with np.errstate(all="ignore"):  # whoever uses the value checks for NaN
                value = float(FUNCTIONS[name](*known))
            if math.isfinite(value):
                return self.number(value)
            return self._kept(Operation(name, takes))  # such as 0/0
        same = self._simpler(name, takes, numbers)
        return self._kept(Operation(name, takes)) if same is None else same

    def number_of(self, i: int) -> float | None:
        """Return the value of an operation that is a number, else None."""
        operation = self.operations[i]
        return operation.value if operation.name == "number" else None

    def needed(self, results: Sequence[int]) -> list[int]:
        """Return the operations behind some results, in order."""
        reached = set(results)
        for i in range(max(results, default=-1), -1, -1):
            if i in reached:
                reached.update(self.operations[i].takes)
        return sorted(reached)

    def variables(self, result: int) -> set[int]:
        """Return the variables that a result depends on."""
        behind = (self.operations[i] for i in self.needed([result]))
        return {int(operation.value) for operation in behind if operation.name == "variable"}

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
        """Return an equal result with less work; None if no rule applies."""
        first, last = numbers[0], numbers[-1]
        left, right = takes[0], takes[-1]
        simpler: int | None = None
        if (name, last) in _KEEP_FIRST or (name == "where" and takes[1] == takes[2]):
            simpler = left if name != "where" else right
        elif (name, first) in _KEEP_LAST:
            simpler = right
        elif name == "mul" and 0 in (first, last):
            other = right if first == 0 else left
            known = self.number_of(other) is not None or self.variables(other)
            simpler = self.number(0.0) if known else None
        elif (name, first) == ("sub", 0):
            simpler = self.add("neg", right)
        elif (name, last) == ("pow", 0):
            simpler = self.number(1.0)
        elif name == "neg" and self.operations[left].name == "neg":
            simpler = self.operations[left].takes[0]
        return simpler

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
        """Apply the rule of an operation to the slopes of its operands."""
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


class Bounds(NamedTuple):
    """The least and the greatest possible value."""

    low: FloatArray
    high: FloatArray


def ranges(
    plan: Iterable[tuple[int, Operation]], time: Bounds, state: Mapping[int, Bounds]
) -> Bounds:
    """Bounds of the last of numbered operations in order; infinite if it may have no value.

    If the bounds of an operation are NaN, those of its results are NaN or infinite. So the last
    bounds show whether any were NaN. Only then, which is rare, each operation is checked.
    """
    with np.errstate(all="ignore"):
        bounds_of_last = _ranges(plan, time, state, lambda bounds: bounds)
        return (
            bounds_of_last
            if not np.isnan(bounds_of_last.low + bounds_of_last.high).any()
            else _ranges(plan, time, state, _known)
        )


def _ranges(
    plan: Iterable[tuple[int, Operation]],
    time: Bounds,
    state: Mapping[int, Bounds],
    known: Callable[[Bounds], Bounds],
) -> Bounds:
    """As `ranges`; `known` is applied to the bounds of each operation."""
    results: dict[int, Bounds] = {}
    last = time
    for i, (name, takes, value) in plan:
        if name == "number":
            number = np.float64(value)
            last = Bounds(number, number)
        elif name == "variable":
            last = time if value == TIME else state[int(value)]
        elif name == "mul" and takes[0] == takes[1]:
            last = _even(results[takes[0]], 2.0)
        else:
            last = known(_BY_NAME[name](*(results[k] for k in takes)))
        results[i] = last
    return last


# --- operations -----------------------------------------------------------------------------------

_WHOLE = Bounds(np.array(-np.inf), np.array(np.inf))


def _known(bounds: Bounds) -> Bounds:
    """Bounds with infinite values in place of NaN."""
    low, high = bounds
    if not np.isnan(low + high).any():
        return bounds
    return Bounds(np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high))


def _of_corners(function: Callable[..., FloatArray], a: Bounds, b: Bounds) -> Bounds:
    """Bounds of a function of two numbers with its extremes at extremes of both."""
    p, q, r, s = (function(x, y) for x in a for y in b)
    return Bounds(
        np.minimum(np.minimum(p, q), np.minimum(r, s)),
        np.maximum(np.maximum(p, q), np.maximum(r, s)),
    )


def _bounds_where(condition: FloatArray | BoolArray, chosen: Bounds, otherwise: Bounds) -> Bounds:
    return Bounds(
        np.where(condition, chosen.low, otherwise.low),
        np.where(condition, chosen.high, otherwise.high),
    )


def _mul(a: Bounds, b: Bounds) -> Bounds:
    """Bounds of a product; usually one factor is a number."""
    if b.low is b.high:
        a, b = b, a
    if a.low is not a.high:
        return _of_corners(np.multiply, a, b)
    ends = a.low * b.low, a.low * b.high
    return Bounds(*(ends if a.low >= 0 else reversed(ends)))


def _rising(name: str) -> Callable[[Bounds], Bounds]:
    return lambda a: Bounds(FUNCTIONS[name](a.low), FUNCTIONS[name](a.high))


def _div(a: Bounds, b: Bounds) -> Bounds:
    apart = (b.low > 0) | (b.high < 0)
    return _bounds_where(apart, _of_corners(np.divide, a, b), _WHOLE)


def _even(a: Bounds, exponent: FloatArray | float) -> Bounds:
    """Bounds of an even power, not negative."""
    powers = [np.abs(x) ** exponent for x in a]
    through = (a.low <= 0) & (a.high >= 0)
    return Bounds(np.where(through, 0.0, np.minimum(*powers)), np.maximum(*powers))


def _pow(a: Bounds, b: Bounds) -> Bounds:
    whole = (b.low == b.high) & (np.round(b.low) == b.low)
    even = whole & (np.mod(b.low, 2) == 0)
    through = (a.low <= 0) & (a.high >= 0)
    corners = _of_corners(np.power, a, b)
    positive = (a.low > 0) | ((a.low == 0) & (b.low > 0))
    bounds = _bounds_where(positive | (whole & ~even & (b.low > 0)), corners, _WHOLE)
    of_even = _bounds_where(b.low > 0, _even(a, np.abs(b.low)), corners)
    bounds = _bounds_where(even & ~(through & (b.low < 0)), of_even, bounds)
    return _bounds_where(whole & (b.low < 0) & ~through, corners, bounds)


def _wave(a: Bounds, top: float, name: str) -> Bounds:
    """Bounds of a sine or cosine with maxima at `top` plus whole turns."""
    begin, end = ((x - top) / (2 * np.pi) for x in a)  # in turns from a top
    first, last = (FUNCTIONS[name](x) for x in a)
    over_bottom = np.ceil(begin - 0.5) <= np.floor(end - 0.5)
    over_top = np.ceil(begin) <= np.floor(end)
    return Bounds(
        np.where(over_bottom, -1.0, np.minimum(first, last)),
        np.where(over_top, 1.0, np.maximum(first, last)),
    )


def _tan(a: Bounds) -> Bounds:
    one_branch = np.floor(a.low / np.pi + 0.5) == np.floor(a.high / np.pi + 0.5)
    return _bounds_where(one_branch, _rising("tan")(a), _WHOLE)


def _atan2(a: Bounds, b: Bounds) -> Bounds:
    away = (b.low > 0) | (a.low > 0) | (a.high < 0)
    corners = _of_corners(np.arctan2, a, b)
    return _bounds_where(away, corners, Bounds(np.array(-np.pi), np.array(np.pi)))


def _bounds_less(a: Bounds, b: Bounds) -> Bounds:
    return Bounds((a.high < b.low).astype(float), (~(a.low >= b.high)).astype(float))


def _choice(condition: Bounds, chosen: Bounds, otherwise: Bounds) -> Bounds:
    either = Bounds(np.minimum(chosen.low, otherwise.low), np.maximum(chosen.high, otherwise.high))
    bounds = _bounds_where(condition.low > 0, chosen, either)
    return _bounds_where(condition.high == 0, otherwise, bounds)


_BY_NAME: dict[str, Callable[..., Bounds]] = {
    **{name: _rising(name) for name in ("asin", "atan", "exp", "log", "sqrt", "tanh", "sign")},
    "neg": lambda a: Bounds(-a.high, -a.low),
    "add": lambda a, b: Bounds(a.low + b.low, a.high + b.high),
    "sub": lambda a, b: Bounds(a.low - b.high, a.high - b.low),
    "mul": _mul,
    "div": _div,
    "pow": _pow,
    "sin": lambda a: _wave(a, np.pi / 2, "sin"),
    "cos": lambda a: _wave(a, 0.0, "cos"),
    "tan": _tan,
    "acos": lambda a: Bounds(np.arccos(a.high), np.arccos(a.low)),
    "atan2": _atan2,
    "abs": lambda a: _even(a, 1.0),
    "less": _bounds_less,
    "where": _choice,
}


NOTHING: Mapping[int, Bounds] = MappingProxyType({})


class Addend:
    """A term of the sum that is a formula, perhaps with the opposite sign; numbers are left out."""

    def __init__(
        self, tape: Tape, result: int, held: Mapping[int, Operation] | None = None
    ) -> None:
        self._tape, self._result, self._held = tape, result, held
        self._value, self._unheld = Program(tape, [result], held), Program(tape, [result])

    @property
    def of_time(self) -> bool:
        """Whether the term depends on time only."""
        return self._tape.variables(self._result) == {TIME}

    def derivative(self, order: int) -> Addend:
        """The derivative of any order by time."""
        return self if order == 0 else self._rate.derivative(order - 1)

    @cached_property
    def _rate(self) -> Addend:
        return Addend(self._tape, self._tape.slope(self._result), self._held)

    def values(self, time: FloatArray, state: Sequence[FloatArray]) -> FloatArray:
        """Values (n,) at instants (n,), s, and values (n,) of senses; NaN without a value."""
        return np.broadcast_to(np.asarray(self._value.run(time, state)[0], float), np.shape(time))

    def ranges(self, time: Bounds, state: Mapping[int, Bounds] = NOTHING) -> Bounds:
        """Bounds (n,) of the term for bounds of t (s) and of senses.

        A derivative depends on derivatives of senses, too: see `RATES`.
        """
        bounds = ranges(self._value.plan, time, state)
        if (np.isfinite(bounds.low) & np.isfinite(bounds.high)).all():
            return bounds
        unheld = ranges(self._unheld.plan, time, state)  # see `Expression._values`
        return Bounds(
            *(np.where(np.isfinite(x), x, y) for x, y in zip(bounds, unheld, strict=True))
        )


ORDERS = 0, 2, 4, 8  # n above: higher ones cost more; steps integrate the last one exactly
PARTS = 64  # of the time, at first
MOST_PARTS = 100_000  # at the same time: if more are needed, a warning says so
HALVINGS = 40  # of the time, down to rounding
SHORTER = 6.0  # ratio of widths: a part this much narrower than near ones is a pulse
STEP = 4.0  # of the width of a wide part: how far a step chosen for it may go beyond
MOST_POLES = 32  # parts that are halved further, the first ones: more poles are not needed
POINT_HALVINGS = 34  # of the first parts, down to 1e-12 of the time
# Of the time: distances from a point at which values are compared.
NEAR_POINT, FAR_FROM_POINT = 1e-8, 1e-5
GROWS = 10.0  # ratio near to far: a thousand at a pole of order 1, about 1 for a logarithm


def zeros(term: Addend, begin: float, end: float) -> FloatArray:
    """Instants (n,) s after `begin`, in order, at which a term of time is zero."""
    edges = np.linspace(begin, end, PARTS + 1)
    low, high = edges[:-1], edges[1:]
    rate, instants = term.derivative(1), []
    for _ in range(HALVINGS):
        within = Bounds(low, high)
        value, slope = (
            np.broadcast_arrays(*term_or_rate.ranges(within), low) for term_or_rate in (term, rate)
        )
        through = (value[0] <= 0) & (value[1] >= 0)
        monotone = (slope[0] > 0) | (slope[1] < 0)
        crossed = through & monotone
        instants.append(_crossed(term, low[crossed], high[crossed]))
        left = through & ~monotone & ((slope[0] != 0) | (slope[1] != 0))
        low, high = low[left], high[left]
        if not len(low) or 2 * len(low) > MOST_PARTS:
            break
        low, high = _halved(low, high)
    starts = np.flatnonzero(np.diff(low, prepend=-np.inf) > 2 * (high - low))
    instants.append((low[starts] + high[np.append(starts[1:], len(low))[: len(starts)] - 1]) / 2)
    roots = np.sort(np.concatenate(instants))
    return roots[np.diff(roots, prepend=begin) > SUM_ROUNDING * (end - begin)]


def _crossed(term: Addend, low: FloatArray, high: FloatArray) -> FloatArray:
    """Zeros of a term that is monotone in each of these parts; parts without zero are left out."""
    before, after = (np.sign(term.values(side, [])) for side in (low, high))
    low, high, before = (column[before * after <= 0] for column in (low, high, before))
    while len(low) and (high - low > LAST_PLACES * np.spacing(np.abs(high)) / 2).any():
        middle = (low + high) / 2
        same = np.sign(term.values(middle, [])) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return high


def _halved(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    middle = (low + high) / 2
    return np.stack([low, middle], -1).ravel(), np.stack([middle, high], -1).ravel()


def resolved(
    term: Addend,
    edges: FloatArray,
    cost: Callable[[FloatArray], FloatArray | float],
    allowed: float,
    state: Callable[[Bounds], Mapping[int, Bounds]] = lambda _: NOTHING,
) -> tuple[FloatArray, FloatArray]:
    """Halve parts of a time (s) until polynomials in them show a term, with an error of `allowed`.

    `edges` (n,), s, are those of the first parts: the term has kinks at them. `cost` is the error
    by a unit of hidden area in parts that begin at given times (s). `state` returns bounds of
    senses, and of their derivatives, over parts. Kinks by the state count as smooth. Return all
    edges, and the ends (parts, 2) of unresolved parts if they are too many.
    """
    low, high = edges[:-1], edges[1:]
    all_edges = [edges]
    for _ in range(HALVINGS):
        near = LAST_PLACES * np.spacing(np.abs(high))
        low, high = low[wide := high - low > 4 * near], high[wide]
        within, width = Bounds(low + near[wide], high - near[wide]), high - low
        for rest, bounded in remainders(term, within, state(within)):
            with np.errstate(all="ignore"):
                hidden = cost(low) * width * rest
            # Where a derivative has no bounds, higher ones have none: they are not asked for.
            if hidden[bounded].sum() <= allowed / 2:
                break
        by_size = np.argsort(hidden)
        summed = np.cumsum(hidden[by_size])
        plain = np.count_nonzero(summed <= allowed / 2)
        allowed -= summed[plain - 1] if plain else 0.0
        left = np.sort(by_size[plain:])
        low, high = low[left], high[left]
        if not len(low) or 2 * len(low) > MOST_PARTS:
            break
        all_edges.append((low + high) / 2)
        low, high = _halved(low, high)
    else:
        low, high = low[:0], high[:0]
    return np.unique(np.concatenate(all_edges)), np.stack([low, high], -1)


def remainders(
    term: Addend, within: Bounds, state: Mapping[int, Bounds] = NOTHING
) -> Iterator[tuple[FloatArray, BoolArray]]:
    """Largest remainders of a term in parts (n,), for polynomials of increasing degree.

    Beside them it is told in which parts the derivative of that degree has bounds. `state` has
    bounds of senses, and of their derivatives, over the parts.
    """
    width = within.high - within.low
    rest = np.full(width.shape, np.inf)
    for order in ORDERS:
        with np.errstate(all="ignore"):
            low, high = term.derivative(order).ranges(within, state)
            size = (width / 4) ** order / factorial(order)
            rest = np.fmin(rest, size * (high - low))
            bounded = np.isfinite(np.broadcast_to(high - low, width.shape))
        yield rest, bounded


def pulses(edges: FloatArray) -> FloatArray:
    """Edges (s) of narrow parts that a step chosen for a wider part near them could skip."""
    begin, end = edges[:-1], edges[1:]
    width = end - begin
    short = np.zeros(len(width), dtype=bool)
    size = float(edges[-1] - edges[0])
    while len(width) and size > width.min():
        wide = width >= size
        before = np.maximum.accumulate(np.where(wide, end, -np.inf))
        after = np.minimum.accumulate(np.where(wide, begin, np.inf)[::-1])[::-1]
        near = np.minimum(begin - before, after - end) <= STEP * size
        short |= near & (width <= size / SHORTER)
        size /= 2
    return np.union1d(begin[short], end[short])


def pole(term: Addend, begin: float, end: float) -> float | None:
    """Instant (s) between two at which a term of time grows without bound; None if it does not.

    Interval arithmetic leaves shorter and shorter parts that may have no bounds. At a point that is
    left in the end the term may still be bounded: `where` chooses another formula there, or the
    numerator is zero, too, as in sin(t)/t. So the values near the point decide.
    """
    edges = np.linspace(begin, end, PARTS + 1)
    low, high = edges[:-1], edges[1:]
    for _ in range(POINT_HALVINGS):
        bounds = term.ranges(Bounds(low, high))
        left = np.flatnonzero(~np.isfinite(bounds).all(axis=0))[:MOST_POLES]
        if not len(left):
            return None
        low, high = _halved(low[left], high[left])
    for time in ((low + high) / 2).tolist():
        if _grows(term, time, begin, end):
            return begin if time - begin < NEAR_POINT * (end - begin) else time
    return None


def _grows(term: Addend, time: float, begin: float, end: float) -> bool:
    """Tell whether values grow towards an instant, from one side at least."""

    def sizes(part: float) -> FloatArray:
        away = part * (end - begin) * np.array([-1.0, 1.0])
        return np.abs(term.values((time + away).clip(begin, end), []))

    near = sizes(NEAR_POINT)
    return bool((np.isinf(near) | (near / GROWS > sizes(FAR_FROM_POINT))).any())
