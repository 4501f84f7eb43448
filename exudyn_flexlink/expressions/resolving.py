"""What bounds tell of a function of time: where it is zero or has a pole, and what parts show it.

Values at instants may miss a short pulse. So times are halved until interval arithmetic leaves
nothing open. In parts short enough a term f is a polynomial of degree n, but for the remainder of
interpolation at Chebyshev points, ``(w/4)^n (max f^(n) - min f^(n)) / n!`` in a part of width w.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from math import factorial

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions.ranges import NOTHING, Addend, Bounds

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
            rest = np.fmin(rest, (width / 4) ** order / factorial(order) * (high - low))
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
