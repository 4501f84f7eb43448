"""Where event functions fall to zero within a step, and where quantities turn; no mechanics.

An event function (m, or any unit) is positive as long as the present equations hold. It is
evaluated a few times within the step. If it falls below zero and rises again between two of these
instants, a zero of its rate shows that. Right after an event the function may start at zero: then a
fall below zero counts only after it has risen.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isnan
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.polynomial import chebyshev
from scipy.optimize import brentq

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.integrate.problem import DIVERGED, NoConvergenceError
from exudyn_flexlink.rounding import EVENT_TIME, ROUNDING

Turns = tuple[IndexArray, FloatArray, FloatArray]

LOOKS_AT_TURNS = (9, 9, 9)  # on a stretch, and twice between the neighbours of the highest look


def highest(
    value: Callable[[FloatArray], FloatArray],
    low: FloatArray,
    high: FloatArray,
    looks: tuple[int, ...] = LOOKS_AT_TURNS,
) -> FloatArray:
    """Places (c,) between `low` and `high` (c,) where `value`, given places (c, p), is highest.

    The vertex of a parabola through the last looks is returned; a peak next to an end counts if it
    is higher than the end. If there are several peaks, it is one that the first looks see.
    """
    rows = np.arange(len(low))
    for points in looks:
        times = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, points)
        values = value(times)
        best = np.argmax(values, axis=1)
        low, high = (
            times[rows, np.maximum(best - 1, 0)],
            times[rows, np.minimum(best + 1, points - 1)],
        )
    middle = np.clip(best, 1, points - 2)
    before, top, after = (values[rows, middle + k] for k in (-1, 0, 1))
    bend = before - 2 * top + after
    aside = np.divide(0.5 * (before - after), bend, out=np.zeros_like(bend), where=bend < 0)
    vertex = times[rows, middle] + np.clip(aside, -1, 1) * (times[:, 1] - times[:, 0])
    peaks = (best == middle) | (value(vertex[:, None])[:, 0] > values[rows, best])
    return np.asarray(np.where(peaks, vertex, times[rows, best]))


Number = TypeVar("Number", float, complex)
Array = TypeVar("Array", FloatArray, ComplexArray)


def chebyshev_sum(coefficients: list[Number], part: float) -> Number:
    """Sum of Chebyshev's polynomials at a single part of the step, by Clenshaw's recurrence."""
    x = 4 * part - 2
    b1 = b2 = 0 * coefficients[0]
    for c in reversed(coefficients[1:]):
        b1, b2 = c + x * b1 - b2, b1
    return coefficients[0] + 0.5 * x * b1 - b2


class StepPolynomial:
    """The polynomial through values and slopes at `nodes` (n,), parts of a step, 0 and 1 included.

    It is the polynomial of the step itself if that has a degree below 2 n. Coefficients (..., 2 n)
    are those of Chebyshev's polynomials, which rounding affects least.
    """

    def __init__(self, nodes: FloatArray) -> None:
        self.nodes = nodes
        count = len(nodes)
        values, slope = _rows(nodes, 2 * count)
        self._derivatives = [np.linalg.inv(np.vstack([values, slope]))]
        for _ in range(2):
            self._derivatives.append(np.asarray(chebyshev.chebder(self._derivatives[-1], scl=2)))
        values, slope = _rows(nodes, count)
        self._slopes = slope @ np.linalg.inv(values)

    def slopes(self, values: FloatArray) -> FloatArray:
        """Slopes per step (m, n, c) of the polynomials through values (m, n, c) alone."""
        return np.asarray(np.einsum("ij,mjc->mic", self._slopes, values))

    def coefficients(self, values: Array, slopes: Array, order: int = 0) -> Array:
        """Coefficients (c, 2 n - order) from values (c, n) and slopes per step (c, n).

        They are those of the derivative of this `order`, 0 to 2. Within the step this derivative is
        no larger than the sum of the coefficients' absolute values.
        """
        both = np.concatenate([values, slopes], axis=1)
        return np.asarray(both @ self._derivatives[order].T)

    @staticmethod
    def value(coefficients: FloatArray, parts: FloatArray) -> FloatArray:
        """Values (c, p) at parts (c, p) of the step."""
        columns = coefficients.T[:, :, None]
        return np.asarray(chebyshev.chebval(2 * parts - 1, columns, tensor=False))

    @staticmethod
    def derivative(coefficients: FloatArray) -> FloatArray:
        """Coefficients of the slope per step."""
        return np.asarray(chebyshev.chebder(coefficients, scl=2, axis=1))

    def turns(
        self, time: FloatArray, length: FloatArray, values: FloatArray, slopes: FloatArray
    ) -> Turns:
        """Find where quantities turn inside steps that begin at `time` (m,) s, of `length` (m,) s.

        `values` and `slopes` per step are (m, n, c). Returns the quantity's number, the instant (s)
        and the value of every turn, (k,) each.
        """
        signs = np.sign(slopes)  # products of slopes may overflow
        step, piece, which = np.nonzero(signs[:, :-1] * signs[:, 1:] < 0)
        turning = values[step, :, which], slopes[step, :, which]
        coefficients = self.coefficients(*turning)
        sign = signs[step, piece, which][:, None]
        ends = self.nodes[piece], self.nodes[piece + 1]
        part = highest(lambda parts: sign * self.value(coefficients, parts), *ends)
        return (
            which,
            time[step] + part * length[step],
            self.value(coefficients, part[:, None])[:, 0],
        )


class TurnSeeker:
    """Collects, step by step, the instants at which quantities (c,) turn back."""

    def __init__(self, count: int) -> None:
        # Instants and values of each quantity; the last entry is the end of the last step.
        self._kept: list[list[FloatArray]] = [[] for _ in range(count)]
        self._way = np.zeros(count)  # 1 if the quantity rose last, -1 if it fell

    def take(
        self,
        polynomial: StepPolynomial,
        steps: tuple[FloatArray, FloatArray],
        values: FloatArray,
        slopes: FloatArray,
        rounding: FloatArray | float = 0.0,
    ) -> None:
        """Take steps in a row, which begin at instants (m,) s and have lengths (m,) s.

        `values` and `slopes` per step are those at the polynomial's nodes, (m, n, c). A quantity
        that changes by less than `rounding` (c,) in a step counts as still.
        """
        time, length = steps
        still = np.maximum(ROUNDING * np.abs(values).max(axis=(0, 1)), rounding)
        slopes = np.where(np.abs(slopes) <= still, 0.0, slopes)
        which, times, turned = polynomial.turns(time, length, values, slopes)
        nodes = (time[:, None] + polynomial.nodes * length[:, None]).ravel()
        for k, kept in enumerate(self._kept):
            inside = which == k
            path = np.stack([np.append(nodes, times[inside]),
                            np.append(values[:, :, k], turned[inside])])  # fmt: skip
            path = path[:, np.argsort(path[0], kind="stable")]
            if kept:
                path = np.concatenate([kept.pop(), path], axis=1)
            else:
                kept.append(path[:, :1])
            moved = np.diff(path[1])
            moving = np.flatnonzero(np.abs(moved) > still[k])
            ways = np.append(self._way[k], np.sign(moved[moving]))
            kept += [path[:, moving[ways[:-1] * ways[1:] < 0]], path[:, -1:]]
            self._way[k] = ways[-1] or self._way[k]

    def turning_points(self, which: int) -> tuple[FloatArray, FloatArray]:
        """Instants (k,) s, in order, and values (k,): first instant, turns, last instant."""
        time, value = np.concatenate([np.zeros((2, 0)), *self._kept[which]], axis=1)
        return time, value


def _rows(nodes: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Chebyshev's first `count` polynomials at nodes, and their slopes per step, (n, count)."""
    x = 2 * nodes - 1
    values = np.asarray(chebyshev.chebvander(x, count - 1), dtype=np.float64)
    slopes = chebyshev.chebval(x, chebyshev.chebder(np.eye(count), scl=2))
    return values, np.asarray(slopes, dtype=np.float64).T


LOOKS = 8  # instants of a step at which an event function is evaluated
GAP_ROUNDING = 1e-14  # m: an event function that is less than this below zero counts as zero
HALVINGS = 40  # of the time to the next look, in the search for an instant after which it rose

Function = Callable[[float], float]
"""A value, or a rate, as a function of time (s)."""


class Guard:
    """A function of time whose zero ends a step, since the equations change there.

    If it `bends`, forces are continuous at the zero: the last step still predicts the next one.
    """

    bends = False

    def late(self, step: Any) -> float:  # noqa: ARG002
        """How long (s) before a step's end the zero was; negative: after; 0: near enough."""
        return 0.0

    def cross(self, time: float) -> None:
        """Change the equations at this time (s)."""
        raise NotImplementedError


class Crossing(NamedTuple):
    """The instant (s) within a step at which a guard is zero, and the guard."""

    time: float
    guard: Guard


def zero(value: Function, begin: float, end: float) -> float:
    """Instant (s) of the zero of a value that changes its sign between two instants.

    Raises:
        NoConvergenceError: the value is not a number at some instant between.

    """

    def number(t: float) -> float:
        result = value(t)
        if isnan(result):
            raise NoConvergenceError(DIVERGED)
        return result

    return float(brentq(number, begin, end, xtol=EVENT_TIME, rtol=1e-15))


def fall(value: Function, begin: float, end: float) -> float:
    """Instant (s) at which a value falls to zero, if it is negative at `end`."""
    return begin if value(begin) <= 0 else zero(value, begin, end)


def first_fall(
    value: Function, rate: Function | None, within: tuple[float, float], looks: int = LOOKS
) -> float | None:
    """Instant (s) at which an event function first falls below zero; None if it does not.

    With its `rate` a fall between two looks is seen, too; of a function that is the least of
    several values, the rate may be that of one of them. If the function starts at zero, but for the
    error of the last event, a fall counts as soon as it is lower than at the start.
    """
    t, end = within
    slope = next_slope = 0.0 if rate is None else rate(t)
    for after in np.linspace(t, end, looks + 1)[1:].tolist():
        places = [after]
        if rate is not None:
            slope, next_slope = next_slope, rate(after)
            if slope < 0 < next_slope:
                places = [zero(rate, t, after), after]
        for place in places:
            if value(place) < -GAP_ROUNDING:
                if value(t) > GAP_ROUNDING:
                    return zero(value, t, place)
                if value(place) < value(t) - GAP_ROUNDING:
                    return _after_rising(value, t, place)
            t = place
    return None


def _after_rising(value: Function, t: float, after: float) -> float:
    """Instant (s) at which a value that starts at zero falls: t if it does not rise before."""
    between = (t + (after - t) * 0.5**k for k in range(1, HALVINGS))
    risen = next((place for place in between if value(place) > 0), None)
    return t if risen is None else zero(value, risen, after)
