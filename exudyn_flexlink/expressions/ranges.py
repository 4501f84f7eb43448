"""Between which bounds a formula stays while what it takes stays between bounds.

Interval arithmetic (R. E. Moore, *Interval Analysis*, 1966): every operation takes the bounds of
what it takes. They may be wider than the formula's range, where it takes the same thing twice, but
never narrower but for rounding. Bounds are pairs of arrays of one shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.expressions.tape import FUNCTIONS, TIME, Tape


class Bounds(NamedTuple):
    """The least and the greatest that something may be."""

    low: FloatArray
    high: FloatArray


def ranges(tape: Tape, result: int, time: Bounds, state: Sequence[Bounds]) -> Bounds:
    """Bounds of a result of a tape; infinite where it may have no value."""
    found: dict[int, Bounds] = {}
    shape = np.shape(time.low)
    with np.errstate(all="ignore"):
        for i in tape.needed([result]):
            name, takes, value = tape.operations[i]
            if name == "number":
                found[i] = Bounds(np.full(shape, value), np.full(shape, value))
            elif name == "variable":
                found[i] = time if value == TIME else state[int(value)]
            elif name == "mul" and takes[0] == takes[1]:
                found[i] = _even(found[takes[0]], 2.0)
            else:
                low, high = _BY_NAME[name](*(found[k] for k in takes))
                found[i] = Bounds(
                    np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
                )
    return found[result]


# --- operations -----------------------------------------------------------------------------------

_WHOLE = Bounds(np.array(-np.inf), np.array(np.inf))


def _of_corners(values: Sequence[FloatArray]) -> Bounds:
    return Bounds(np.minimum.reduce(values), np.maximum.reduce(values))


def _where(condition: FloatArray | BoolArray, one: Bounds, other: Bounds) -> Bounds:
    return Bounds(
        np.where(condition, one.low, other.low), np.where(condition, one.high, other.high)
    )


def _rising(name: str) -> Callable[[Bounds], Bounds]:
    return lambda a: Bounds(FUNCTIONS[name](a.low), FUNCTIONS[name](a.high))


def _mul(a: Bounds, b: Bounds) -> Bounds:
    return _of_corners([x * y for x in a for y in b])


def _div(a: Bounds, b: Bounds) -> Bounds:
    apart = (b.low > 0) | (b.high < 0)
    return _where(apart, _of_corners([x / y for x in a for y in b]), _WHOLE)


def _even(a: Bounds, exponent: FloatArray | float) -> Bounds:
    """Bounds of an even power, not negative."""
    powers = [np.abs(x) ** exponent for x in a]
    through = (a.low <= 0) & (a.high >= 0)
    return Bounds(np.where(through, 0.0, np.minimum(*powers)), np.maximum(*powers))


def _pow(a: Bounds, b: Bounds) -> Bounds:
    whole = (b.low == b.high) & (np.round(b.low) == b.low)
    even = whole & (np.mod(b.low, 2) == 0)
    through = (a.low <= 0) & (a.high >= 0)
    corners = _of_corners([np.power(x, y) for x in a for y in b])
    positive = a.low > 0
    found = _where(positive | (whole & ~even & (b.low > 0)), corners, _WHOLE)
    of_even = _where(b.low > 0, _even(a, np.abs(b.low)), corners)
    found = _where(even & ~(through & (b.low < 0)), of_even, found)
    return _where(whole & (b.low < 0) & ~through, corners, found)


def _wave(a: Bounds, top: float, name: str) -> Bounds:
    """Bounds of a sine or cosine whose tops are at `top` and whole turns from there."""
    turn, ends = 2 * np.pi, _of_corners([FUNCTIONS[name](x) for x in a])

    def passes(place: float) -> BoolArray:
        return np.asarray(np.ceil((a.low - place) / turn) <= np.floor((a.high - place) / turn))

    return Bounds(
        np.where(passes(top + np.pi), -1.0, ends.low), np.where(passes(top), 1.0, ends.high)
    )


def _tan(a: Bounds) -> Bounds:
    one_branch = np.floor(a.low / np.pi + 0.5) == np.floor(a.high / np.pi + 0.5)
    return _where(one_branch, _rising("tan")(a), _WHOLE)


def _atan2(a: Bounds, b: Bounds) -> Bounds:
    away = (b.low > 0) | (a.low > 0) | (a.high < 0)
    corners = _of_corners([np.arctan2(x, y) for x in a for y in b])
    return _where(away, corners, Bounds(np.array(-np.pi), np.array(np.pi)))


def _abs(a: Bounds) -> Bounds:
    return _even(a, 1.0)


def _less(a: Bounds, b: Bounds) -> Bounds:
    return Bounds((a.high < b.low).astype(float), (a.low < b.high).astype(float))


def _choice(condition: Bounds, one: Bounds, other: Bounds) -> Bounds:
    either = Bounds(np.minimum(one.low, other.low), np.maximum(one.high, other.high))
    found = _where(condition.low > 0, one, either)
    return _where(condition.high == 0, other, found)


_BY_NAME: dict[str, Callable[..., Bounds]] = {
    "neg": lambda a: Bounds(-a.high, -a.low),
    "add": lambda a, b: Bounds(a.low + b.low, a.high + b.high),
    "sub": lambda a, b: Bounds(a.low - b.high, a.high - b.low),
    "mul": _mul,
    "div": _div,
    "pow": _pow,
    "sin": lambda a: _wave(a, np.pi / 2, "sin"),
    "cos": lambda a: _wave(a, 0.0, "cos"),
    "tan": _tan,
    "asin": _rising("asin"),
    "acos": lambda a: Bounds(np.arccos(a.high), np.arccos(a.low)),
    "atan": _rising("atan"),
    "atan2": _atan2,
    "exp": _rising("exp"),
    "log": _rising("log"),
    "sqrt": _rising("sqrt"),
    "tanh": _rising("tanh"),
    "abs": _abs,
    "sign": _rising("sign"),
    "less": _less,
    "where": _choice,
}
