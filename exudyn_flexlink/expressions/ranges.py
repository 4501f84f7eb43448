"""Between which bounds a formula stays while what it takes stays between bounds.

Interval arithmetic (R. E. Moore, *Interval Analysis*, 1966): every operation takes the bounds of
what it takes. They may be wider than the formula's range, where it takes the same thing twice, but
never narrower but for rounding. Bounds are pairs of arrays of one shape, or of numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.expressions.tape import FUNCTIONS, TIME, Operation, Program, Tape


class Bounds(NamedTuple):
    """The least and the greatest that something may be."""

    low: FloatArray
    high: FloatArray


def ranges(
    plan: Iterable[tuple[int, Operation]], time: Bounds, state: Mapping[int, Bounds]
) -> Bounds:
    """Bounds of the last of numbered operations in order; infinite where it may have no value."""
    found: dict[int, Bounds] = {}
    last = time
    with np.errstate(all="ignore"):
        for i, (name, takes, value) in plan:
            if name == "number":
                last = Bounds(np.float64(value), np.float64(value))
            elif name == "variable":
                last = time if value == TIME else state[int(value)]
            elif name == "mul" and takes[0] == takes[1]:
                last = _even(found[takes[0]], 2.0)
            else:
                last = _known(_BY_NAME[name](*(found[k] for k in takes)))
            found[i] = last
    return last


# --- operations -----------------------------------------------------------------------------------

_WHOLE = Bounds(np.array(-np.inf), np.array(np.inf))


def _known(found: Bounds) -> Bounds:
    """Infinite bounds where there are none."""
    low, high = found
    if not np.isnan(low + high).any():
        return found
    return Bounds(np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high))


def _of_corners(function: Callable[..., FloatArray], a: Bounds, b: Bounds) -> Bounds:
    """Bounds of a function of two numbers that has its extremes where both have theirs."""
    p, q, r, s = (function(x, y) for x in a for y in b)
    return Bounds(
        np.minimum(np.minimum(p, q), np.minimum(r, s)),
        np.maximum(np.maximum(p, q), np.maximum(r, s)),
    )


def _bounds_where(condition: FloatArray | BoolArray, one: Bounds, other: Bounds) -> Bounds:
    return Bounds(
        np.where(condition, one.low, other.low), np.where(condition, one.high, other.high)
    )


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
    found = _bounds_where(positive | (whole & ~even & (b.low > 0)), corners, _WHOLE)
    of_even = _bounds_where(b.low > 0, _even(a, np.abs(b.low)), corners)
    found = _bounds_where(even & ~(through & (b.low < 0)), of_even, found)
    return _bounds_where(whole & (b.low < 0) & ~through, corners, found)


def _wave(a: Bounds, top: float, name: str) -> Bounds:
    """Bounds of a sine or cosine whose tops are at `top` and whole turns from there."""
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
    return Bounds((a.high < b.low).astype(float), (a.low < b.high).astype(float))


def _choice(condition: Bounds, one: Bounds, other: Bounds) -> Bounds:
    either = Bounds(np.minimum(one.low, other.low), np.maximum(one.high, other.high))
    found = _bounds_where(condition.low > 0, one, either)
    return _bounds_where(condition.high == 0, other, found)


_BY_NAME: dict[str, Callable[..., Bounds]] = {
    **{name: _rising(name) for name in ("asin", "atan", "exp", "log", "sqrt", "tanh", "sign")},
    "neg": lambda a: Bounds(-a.high, -a.low),
    "add": lambda a, b: Bounds(a.low + b.low, a.high + b.high),
    "sub": lambda a, b: Bounds(a.low - b.high, a.high - b.low),
    "mul": partial(_of_corners, np.multiply),
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
    """One of the terms, numbers left out, whose sum a formula is; it may enter with a minus."""

    def __init__(
        self, tape: Tape, result: int, held: Mapping[int, Operation] | None = None
    ) -> None:
        self._tape, self._result, self._held = tape, result, held
        self._value, self._own = Program(tape, [result], held), Program(tape, [result])

    @property
    def of_time(self) -> bool:
        """Whether it takes nothing of the state."""
        return self._tape.variables(self._result) == {TIME}

    def derivative(self, order: int) -> Addend:
        """The term's derivative by time, of any order."""
        return self if order == 0 else self._rate.derivative(order - 1)

    @cached_property
    def _rate(self) -> Addend:
        return Addend(self._tape, self._tape.slope(self._result), self._held)

    def values(self, time: FloatArray, state: Sequence[FloatArray]) -> FloatArray:
        """Values (n,) at instants (n,) s and values (n,) of what is sensed; NaN where none is."""
        return np.broadcast_to(np.asarray(self._value.run(time, state)[0], float), np.shape(time))

    def ranges(self, time: Bounds, state: Mapping[int, Bounds] = NOTHING) -> Bounds:
        """Between which bounds (n,) it stays where t (s) and what is sensed do so.

        A derivative takes derivatives of what is sensed, too: see `tape.RATES`.
        """
        found = ranges(self._value.plan, time, state)
        if (np.isfinite(found.low) & np.isfinite(found.high)).all():
            return found
        own = ranges(self._own.plan, time, state)  # see `Expression._found`
        return Bounds(*(np.where(np.isfinite(x), x, y) for x, y in zip(found, own, strict=True)))
