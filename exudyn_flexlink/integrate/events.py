"""Where event functions fall to zero within a step, and where quantities turn; no mechanics.

An event function (m, or any length) is positive as long as the present equations hold. It is
evaluated a few times within the step. Where it falls below zero and rises again between two of
these instants, the zero of its rate shows it. Right after an event it may start at zero: then it
falls after its highest value.
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

Turns = tuple[IndexArray, FloatArray, FloatArray]

LOOKS_AT_TURNS = (9, 9, 9)  # on a stretch and, twice, on what is left around the highest of them
STANDSTILL = 1e-12  # of a value: what moves by less in a step stands still


def highest(
    value: Callable[[FloatArray], FloatArray],
    low: FloatArray,
    high: FloatArray,
    looks: tuple[int, ...] = LOOKS_AT_TURNS,
) -> FloatArray:
    """Places (c,) between `low` and `high` (c,) where a value, of places (c, p), is highest.

    A parabola joins the last looks; a peak next to an end counts if it is higher than the end. Of
    several peaks it is one that the first looks see.
    """
    rows = np.arange(len(low))
    for points in looks:
        at = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, points)
        values = value(at)
        best = np.argmax(values, axis=1)
        low, high = at[rows, np.maximum(best - 1, 0)], at[rows, np.minimum(best + 1, points - 1)]
    middle = np.clip(best, 1, points - 2)
    before, top, after = (values[rows, middle + k] for k in (-1, 0, 1))
    bend = before - 2 * top + after
    aside = np.divide(0.5 * (before - after), bend, out=np.zeros_like(bend), where=bend < 0)
    vertex = at[rows, middle] + np.clip(aside, -1, 1) * (at[:, 1] - at[:, 0])
    peaks = (best == middle) | (value(vertex[:, None])[:, 0] > values[rows, best])
    return np.asarray(np.where(peaks, vertex, at[rows, best]))


Number = TypeVar("Number", float, complex)
Array = TypeVar("Array", FloatArray, ComplexArray)


def chebyshev_sum(coefficients: list[Number], part: float) -> Number:
    """Sum of Chebyshev's polynomials at one part of the step, by Clenshaw's recurrence: faster."""
    x = 4 * part - 2
    b1 = b2 = 0 * coefficients[0]
    for c in reversed(coefficients[1:]):
        b1, b2 = c + x * b1 - b2, b1
    return coefficients[0] + 0.5 * x * b1 - b2


class StepPolynomial:
    """The polynomial through values and slopes at `nodes` (n,), parts of a step, 0 and 1 included.

    It is the step's own polynomial if that has a degree below 2 n. Coefficients (..., 2 n) are
    those of Chebyshev's polynomials, as rounding loses nothing with them.
    """

    def __init__(self, nodes: FloatArray) -> None:
        self.nodes = nodes
        count = len(nodes)
        at, slope = _rows(nodes, 2 * count)
        self._derivatives = [np.linalg.inv(np.vstack([at, slope]))]
        for _ in range(2):
            self._derivatives.append(np.asarray(chebyshev.chebder(self._derivatives[-1], scl=2)))
        at, slope = _rows(nodes, count)
        self._slopes = slope @ np.linalg.inv(at)

    def slopes(self, values: FloatArray) -> FloatArray:
        """Slopes per step (m, n, c) of the polynomials through values (m, n, c) alone."""
        return np.asarray(np.einsum("ij,mjc->mic", self._slopes, values))

    def coefficients(self, values: Array, slopes: Array, order: int = 0) -> Array:
        """Coefficients (c, 2 n - order) from values (c, n) and slopes per step (c, n).

        They describe the derivative of this order, 0 to 2. Nowhere in the step is that larger
        than the sum of their sizes.
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
        part = highest(lambda at: sign * self.value(coefficients, at), *ends)
        return (
            which,
            time[step] + part * length[step],
            self.value(coefficients, part[:, None])[:, 0],
        )


class TurnSeeker:
    """Collects where quantities (c,) turn, step by step: between two instants kept none turns."""

    def __init__(self, count: int) -> None:
        # Instants and values of each quantity; the last ones are those of the last step's end.
        self._kept: list[list[FloatArray]] = [[] for _ in range(count)]
        self._way = np.zeros(count)  # 1 if it rose last, -1 if it fell

    def take(
        self,
        polynomial: StepPolynomial,
        steps: tuple[FloatArray, FloatArray],
        values: FloatArray,
        slopes: FloatArray,
        rounding: FloatArray | float = 0.0,
    ) -> None:
        """Take steps in a row, which begin at instants (m,) s and have lengths (m,) s.

        `values` and `slopes` per step are those at the polynomial's nodes, (m, n, c). What moves
        by less than `rounding` (c,) in a step counts as still.
        """
        time, length = steps
        still = np.maximum(STANDSTILL * np.abs(values).max(axis=(0, 1)), rounding)
        slopes = np.where(np.abs(slopes) <= still, 0.0, slopes)
        which, at, turned = polynomial.turns(time, length, values, slopes)
        nodes = (time[:, None] + polynomial.nodes * length[:, None]).ravel()
        for k, kept in enumerate(self._kept):
            inside = which == k
            path = np.stack([np.append(nodes, at[inside]),
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
        """Instants (k,) s, in order, and values (k,), from the first to the last that was taken."""
        time, value = np.concatenate([np.zeros((2, 0)), *self._kept[which]], axis=1)
        return time, value


def _rows(nodes: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Chebyshev's first `count` polynomials at nodes, and their slopes per step, (n, count)."""
    x = 2 * nodes - 1
    at = np.asarray(chebyshev.chebvander(x, count - 1), dtype=np.float64)
    slopes = chebyshev.chebval(x, chebyshev.chebder(np.eye(count), scl=2))
    return at, np.asarray(slopes, dtype=np.float64).T


EVENT_TIME = 1e-13  # s: accuracy of an event's instant, where the clock resolves it
LOOKS = 8  # instants of a step at which an event function is evaluated
GAP_ROUNDING = 1e-14  # m: an event function that is less than this below zero is zero, rounded
HALVINGS = 40  # of the time to the next look, in the search for where a function rises from zero

Function = Callable[[float], float]
"""A value, or a rate, by the time (s)."""


class Guard:
    """A function of time whose zero ends a step, since the equations change there.

    Where forces only bend there (`bends`), the last step's polynomial still predicts the next one.
    """

    bends = False

    def late(self, step: Any) -> float:  # noqa: ARG002
        """How long (s) before a step's end the zero was; negative: after. 0 if near enough."""
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
        NoConvergenceError: the value is no number in between.

    """

    def number(t: float) -> float:
        at = value(t)
        if isnan(at):
            raise NoConvergenceError(DIVERGED)
        return at

    return float(brentq(number, begin, end, xtol=EVENT_TIME, rtol=1e-15))


def fall(value: Function, begin: float, end: float) -> float:
    """Instant at which a value falls to zero; at `end` it is negative."""
    return begin if value(begin) <= 0 else zero(value, begin, end)


def first_fall(
    value: Function, rate: Function | None, within: tuple[float, float], looks: int = LOOKS
) -> float | None:
    """Find when an event function falls below zero first; None if it does not.

    With its `rate` a fall between two looks is found, too. A function that starts at zero, but for
    the error of the event before, falls only as it gets lower than its start.
    """
    t, end = within
    slope = next_slope = 0.0 if rate is None else rate(t)
    for after in np.linspace(t, end, looks + 1)[1:].tolist():
        lowest = after
        if rate is not None:
            slope, next_slope = next_slope, rate(after)
            if slope < 0 < next_slope:
                lowest = zero(rate, t, after)
        if value(lowest) < -GAP_ROUNDING:
            if value(t) > GAP_ROUNDING:
                return zero(value, t, lowest)
            if value(lowest) < value(t) - GAP_ROUNDING:
                return _after_rising(value, t, lowest)
        t = after
    return None


def _after_rising(value: Function, t: float, after: float) -> float:
    """When a value that starts at zero falls; at once if it does not rise first."""
    between = (t + (after - t) * 0.5**k for k in range(1, HALVINGS))
    risen = next((place for place in between if value(place) > 0), None)
    return t if risen is None else zero(value, risen, after)
