"""What bounds tell of a function of time: where it is zero or has a pole, and what parts show it.

Values at instants may miss a short pulse. So times are halved until interval arithmetic leaves
nothing open. In parts short enough a term f is a polynomial of degree n, but for the remainder of
interpolation at Chebyshev points, ``(w/4)^n (max f^(n) - min f^(n)) / n!`` in a part of width w.

Between which bounds a formula stays while what it takes stays between bounds.

Interval arithmetic (R. E. Moore, *Interval Analysis*, 1966): every operation takes the bounds of
what it takes. They may be wider than the formula's range, where it takes the same thing twice, but
never narrower but for rounding. Bounds are pairs of arrays of one shape, or of numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from math import factorial
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


ORDERS = 0, 2, 4, 8  # n above: higher ones cost more, the last is what steps integrate exactly
PARTS = 64  # of the time that are looked at first
MOST_PARTS = 100_000  # looked at together: where more are needed, it is told
HALVINGS = 40  # of the time: then rounding is near
CLOCK = 4  # units in the last place: how near to a part's ends it may still be of the next one
SAME = 1e-14  # of the time: zeros so near to each other are one
SHORTER = 6.0  # by which a part is a pulse's, beside those that steps may be chosen for
STEP = 4.0  # of such a part's width: how far a step may go beyond it
MOST_POLES = 32  # parts looked at together, the first ones: more poles than these are not needed
POINT_HALVINGS = 34  # of the parts looked at first: then they are 1e-12 of the time
NEAR, FAR = 1e-8, 1e-5  # of the time: how far from a point values are looked at
GROWS = 10.0  # from far to near: a pole of order 1 grows by a thousand, a logarithm hardly


def zeros(term: Addend, begin: float, end: float) -> FloatArray:
    """Instants (n,) s after `begin`, in order, at which a term of time is zero."""
    edges = np.linspace(begin, end, PARTS + 1)
    low, high = edges[:-1], edges[1:]
    rate, found = term.derivative(1), []
    for _ in range(HALVINGS):
        within = Bounds(low, high)
        value, slope = (np.broadcast_arrays(*one.ranges(within), low) for one in (term, rate))
        through = (value[0] <= 0) & (value[1] >= 0)
        monotone = (slope[0] > 0) | (slope[1] < 0)
        crossed = through & monotone
        found.append(_crossed(term, low[crossed], high[crossed]))
        left = through & ~monotone & ((slope[0] != 0) | (slope[1] != 0))
        low, high = low[left], high[left]
        if not len(low) or 2 * len(low) > MOST_PARTS:
            break
        low, high = _halved(low, high)
    starts = np.flatnonzero(np.diff(low, prepend=-np.inf) > 2 * (high - low))
    found.append((low[starts] + high[np.append(starts[1:], len(low))[: len(starts)] - 1]) / 2)
    every = np.sort(np.concatenate(found))
    return every[np.diff(every, prepend=begin) > SAME * (end - begin)]


def _crossed(term: Addend, low: FloatArray, high: FloatArray) -> FloatArray:
    """Zeros of a term that rises or falls in each of these parts, if it has one there."""
    before, after = (np.sign(term.values(one, [])) for one in (low, high))
    low, high, before = (one[before * after <= 0] for one in (low, high, before))
    while len(low) and (high - low > CLOCK * np.spacing(np.abs(high)) / 2).any():
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
    """Halve parts of a time (s) until polynomials in them tell all of a term, but for `allowed`.

    `edges` (n,) s are those of the parts that are halved: the term bends there. `cost` is that of
    an area hidden in parts that begin so (s); `state` gives bounds of what is sensed, and of its
    derivatives, over parts. What bends with the state counts as smooth. Return all edges, and those
    (parts, 2) of the parts that would be too many.
    """
    low, high = edges[:-1], edges[1:]
    found = [edges]
    for _ in range(HALVINGS):
        near = CLOCK * np.spacing(np.abs(high))
        low, high = low[wide := high - low > 4 * near], high[wide]
        within, width = Bounds(low + near[wide], high - near[wide]), high - low
        for rest in remainders(term, within, state(within)):
            with np.errstate(all="ignore"):
                hidden = cost(low) * width * rest
            if hidden.sum() <= allowed / 2:
                break
        by_size = np.argsort(hidden)
        summed = np.cumsum(hidden[by_size])
        plain = np.count_nonzero(summed <= allowed / 2)
        allowed -= summed[plain - 1] if plain else 0.0
        left = np.sort(by_size[plain:])
        low, high = low[left], high[left]
        if not len(low) or 2 * len(low) > MOST_PARTS:
            break
        found.append((low + high) / 2)
        low, high = _halved(low, high)
    else:
        low, high = low[:0], high[:0]
    return np.unique(np.concatenate(found)), np.stack([low, high], -1)


def remainders(
    term: Addend, within: Bounds, state: Mapping[int, Bounds] = NOTHING
) -> Iterator[FloatArray]:
    """What polynomials of ever higher degree do not show of a term in parts (n,), at most.

    `state` gives bounds of what is sensed, and of its derivatives, over the parts.
    """
    width = within.high - within.low
    rest = np.full(width.shape, np.inf)
    for order in ORDERS:
        with np.errstate(all="ignore"):
            low, high = term.derivative(order).ranges(within, state)
            size = (width / 4) ** order / factorial(order)
            rest = np.fmin(rest, size * (high - low))
        yield rest


def pulses(edges: FloatArray) -> FloatArray:
    """Edges (s) of parts that a step chosen for a wider part near them could go over."""
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
    """Instant (s), of two between which a term of time grows without bound; None if it does not.

    Interval arithmetic leaves ever shorter parts in which it may have no bounds. A point that is
    left at last may still be none where it grows: `where` chooses another formula there, or a
    numerator is zero, too, as that of sin(t)/t. So its values near the point decide.
    """
    edges = np.linspace(begin, end, PARTS + 1)
    low, high = edges[:-1], edges[1:]
    for _ in range(POINT_HALVINGS):
        bounds = term.ranges(Bounds(low, high))
        left = np.flatnonzero(~np.isfinite(bounds).all(axis=0))[:MOST_POLES]
        if not len(left):
            return None
        low, high = low[left], high[left]
        low, high = _halved(low, high)
    for time in ((low + high) / 2).tolist():
        if _grows(term, time, begin, end):
            return begin if time - begin < NEAR * (end - begin) else time
    return None


def _grows(term: Addend, time: float, begin: float, end: float) -> bool:
    """Tell whether values grow towards an instant, from one side at least."""

    def sizes(part: float) -> FloatArray:
        away = part * (end - begin) * np.array([-1.0, 1.0])
        return np.abs(term.values((time + away).clip(begin, end), []))

    near = sizes(NEAR)
    return bool((np.isinf(near) | (near / GROWS > sizes(FAR))).any())
