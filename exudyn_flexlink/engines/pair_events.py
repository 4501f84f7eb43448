"""When contacts of a point with a face begin or cease to press, within a step.

A contact presses where its event function is negative, the largest of its gap, of how far its point
is from the face's start, backwards, and of how far beyond its end. Within a step gaps and places
are the polynomials through their values and rates at the step's nodes. An event is located there,
and the step made again to end at it; little is left of the event function then (see `little`), and
its rate tells on which side of the event the contact is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import C
from exudyn_flexlink.integrate.events import EVENT_TIME, first_fall
from exudyn_flexlink.integrate.turning import StepPolynomial, chebyshev_sum

# m, of an event function: what may be left of it at the event. A foil may rest 5e-12 m deep.
EXACT = 1e-12
ALWAYS_CLOSED = -1.0  # m: gap of what is held on its axis from both sides, and never leaves it
NODES = np.array([0.0, *C])
PARTS = np.diff(NODES)[:, None]  # of the step, between its nodes
POLYNOMIAL = StepPolynomial(NODES)


class Seen(NamedTuple):
    """Gap and place (m), their rates (m/s), of contacts: at one instant (c,), or several (m, c)."""

    gap: FloatArray
    place: FloatArray
    gap_rate: FloatArray
    slip: FloatArray

    def pick(self, which: int | slice) -> Seen:
        """Return some of the instants."""
        return Seen(*(own[which] for own in self))

    def then(self, others: Seen) -> Seen:
        """Return them at one instant, followed by those at several others."""
        both = zip(self, others, strict=True)
        return Seen(*(np.concatenate([one[None], after]) for one, after in both))

    def closed(self, which: BoolArray) -> Seen:
        """The same with some as if behind a face that never opens: what is held from both sides."""
        gap = np.where(which, ALWAYS_CLOSED, self.gap)
        return self._replace(gap=gap, gap_rate=np.where(which, 0.0, self.gap_rate))


def event_functions(seen: Seen, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Event functions (c,), m, of contacts with faces so long, and their rates."""
    beyond = seen.place - lengths
    after = beyond > -seen.place
    value = np.where(after, beyond, -seen.place)
    rate = np.where(after, seen.slip, -seen.slip)
    of_gap = seen.gap > value
    return np.where(of_gap, seen.gap, value), np.where(of_gap, seen.gap_rate, rate)


def changed(
    now: Seen, lengths: FloatArray, pressing: BoolArray, time: float, there: int | None
) -> BoolArray:
    """Tell which contacts (c,) begin or cease to press now (s), or did so unseen.

    At an event of contact `there` its event function is zero but for rounding, and about to change
    its sign. If not, it only came near, and crossed zero in a step's polynomial.
    """
    value, rate = event_functions(now, lengths)
    way = np.where(pressing, -1.0, 1.0)
    value, rate = way * value, way * rate
    crosses = (value < -EXACT) | ((value < 0) & (rate < 0))
    if there is not None:
        crosses[there] |= value[there] < little(rate[there], time) and rate[there] < 0
    return np.asarray(crosses)


def late_by(end: Seen, lengths: FloatArray, k: int, time: float) -> float:
    """How long (s) before an end at this time contact k's event was; negative: after. 0: there."""
    value, rate = event_functions(end, lengths)
    if abs(value[k]) < little(rate[k], time) or rate[k] == 0:
        return 0.0
    return float(value[k] / rate[k])


def calm(path: Seen, lengths: FloatArray, pressing: BoolArray, parts: FloatArray) -> BoolArray:
    """Tell of which contacts (c,) it is sure that nothing happened on a `path` of nodes (m, c).

    `parts` (m - 1, 1), s, are the times between nodes. A cubic through values and rates at two of
    them strays from them by less than a sixth of the way that the larger rate covers; the margin is
    sixfold.
    """
    inside = np.minimum(path.place, lengths - path.place)
    gap_rate, slip = np.abs(path.gap_rate), np.abs(path.slip)
    deep = parts * np.maximum(gap_rate[:-1], gap_rate[1:])
    far = parts * np.maximum(slip[:-1], slip[1:])
    before, after = path.gap[:-1], path.gap[1:]
    beside = np.maximum(inside[:-1], inside[1:]) < -far
    found = np.asarray(((np.minimum(before, after) > deep) | beside).all(axis=0))
    which = np.flatnonzero(pressing)
    if len(which):
        within = np.minimum(inside[:-1, which], inside[1:, which]) > far[:, which]
        pressed = np.maximum(before[:, which], after[:, which]) < -deep[:, which]
        found[which] = (pressed & within).all(axis=0)
    return found


def first_of(
    which: IndexArray, path: Seen, lengths: FloatArray, pressing: BoolArray, h: float
) -> tuple[float, int] | None:
    """Part of the step and contact of the first event of `which`; None if there is none."""
    gaps, places = (
        POLYNOMIAL.coefficients(values[:, which].T, h * rates[:, which].T)
        for values, rates in ((path.gap, path.gap_rate), (path.place, path.slip))
    )
    found: list[tuple[float, int]] = []
    for k, gap, place in zip(which.tolist(), gaps, places, strict=True):
        pair = _Event(gap, place, float(lengths[k]), -1.0 if pressing[k] else 1.0)
        part = first_fall(pair.value, pair.rate, (0.0, 1.0))
        if part is not None:
            found.append((part, k))
    return min(found, default=None)


def little(rate: float, time: float) -> float:
    """What (m) an event function of this rate (m/s) that is zero now (s) may be off by."""
    return EXACT + abs(rate) * instant(time, EVENT_TIME)


class _Event:
    """Event function of one contact by parts of a step, positive until something happens."""

    def __init__(self, gap: FloatArray, place: FloatArray, length: float, way: float) -> None:
        self._gap, self._place = gap.tolist(), place.tolist()
        self._gap_rate, self._slip = (
            POLYNOMIAL.derivative(own[None])[0].tolist() for own in (gap, place)
        )
        self._length, self._way = length, way

    def value(self, part: float) -> float:
        """Its value (m) and `EXACT`: as little below zero as an event may leave it is nothing."""
        place = chebyshev_sum(self._place, part)
        beyond = max(-place, place - self._length)
        return self._way * max(chebyshev_sum(self._gap, part), beyond) + EXACT

    def rate(self, part: float) -> float:
        """Its slope (m per step), which changes its sign where gap and end of the face swap."""
        place = chebyshev_sum(self._place, part)
        if chebyshev_sum(self._gap, part) >= max(-place, place - self._length):
            return self._way * chebyshev_sum(self._gap_rate, part)
        slip = chebyshev_sum(self._slip, part)
        return self._way * (slip if place - self._length > -place else -slip)
