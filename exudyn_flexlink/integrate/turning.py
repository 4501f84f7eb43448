"""Where quantities turn within the steps of a run: numerics, no mechanics."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.polynomial import chebyshev

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray

Turns = tuple[IndexArray, FloatArray, FloatArray]

LOOKS_AT_TURNS = (9, 9, 9)  # on a stretch and, twice, on what is left around the highest of them
ROUNDING = 1e-12  # of a value: what moves by less in a step stands still


def highest(
    value: Callable[[FloatArray], FloatArray],
    low: FloatArray,
    high: FloatArray,
    looks: tuple[int, ...] = LOOKS_AT_TURNS,
) -> FloatArray:
    """Places (c,) between `low` and `high` (c,) where a value, of places (c, p), is highest.

    The last looks are joined by a parabola. Of several peaks one that the first looks see is found.
    """
    rows = np.arange(len(low))
    for points in looks:
        at = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, points)
        found = value(at)
        best = np.argmax(found, axis=1)
        low, high = at[rows, np.maximum(best - 1, 0)], at[rows, np.minimum(best + 1, points - 1)]
    middle = np.clip(best, 1, points - 2)
    before, top, after = (found[rows, middle + k] for k in (-1, 0, 1))
    bend = before - 2 * top + after
    aside = np.divide(0.5 * (before - after), bend, out=np.zeros_like(bend), where=bend < 0)
    vertex = at[rows, middle] + np.clip(aside, -1, 1) * (at[:, 1] - at[:, 0])
    return np.asarray(np.where(best == middle, vertex, at[rows, best]))


Number = TypeVar("Number", float, complex)
Array = TypeVar("Array", FloatArray, ComplexArray)


def chebyshev_sum(coefficients: list[Number], part: float) -> Number:
    """Sum of Chebyshev's polynomials at a part of the step (Clenshaw): faster, of one place."""
    x = 4 * part - 2
    one = two = 0 * coefficients[0]
    for c in reversed(coefficients[1:]):
        one, two = c + x * one - two, one
    return coefficients[0] + 0.5 * x * one - two


class StepPolynomial:
    """The polynomial through values and slopes at `nodes` (n,), parts of a step, 0 and 1 included.

    Where a step has a polynomial of its own, of a degree below 2 n, it is that one. Coefficients
    (..., 2 n) are those of Chebyshev's polynomials, with which nothing is lost by rounding.
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

        They are those of the derivative of this order, 0 to 2. Nowhere in the step that is more
        than the sum of their sizes.
        """
        both = np.concatenate([values, slopes], axis=1)
        return np.asarray(both @ self._derivatives[order].T)

    @staticmethod
    def value(coefficients: FloatArray, parts: FloatArray) -> FloatArray:
        """Values (c, p) at parts (c, p) of the step."""
        of_all = coefficients.T[:, :, None]
        return np.asarray(chebyshev.chebval(2 * parts - 1, of_all, tensor=False))

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
        own = values[step, :, which], slopes[step, :, which]
        found = self.coefficients(*own)
        sign = signs[step, piece, which][:, None]
        ends = self.nodes[piece], self.nodes[piece + 1]
        part = highest(lambda at: sign * self.value(found, at), *ends)
        return (which, time[step] + part * length[step], self.value(found, part[:, None])[:, 0])


class TurnSeeker:
    """Collects where quantities (c,) turn, step by step: between two instants kept they do not."""

    def __init__(self, count: int) -> None:
        # Of each quantity instants and values, the last of which is where the last step ended.
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

        `values` and `slopes` per step are those at the polynomial's nodes, (m, n, c). By less
        than `rounding` (c,) nothing is known to move in a step.
        """
        time, length = steps
        still = np.maximum(ROUNDING * np.abs(values).max(axis=(0, 1)), rounding)
        slopes = np.where(np.abs(slopes) <= still, 0.0, slopes)
        which, at, turned = polynomial.turns(time, length, values, slopes)
        nodes = (time[:, None] + polynomial.nodes * length[:, None]).ravel()
        for k, kept in enumerate(self._kept):
            inside = which == k
            own = np.stack([np.append(nodes, at[inside]),
                            np.append(values[:, :, k], turned[inside])])  # fmt: skip
            own = own[:, np.argsort(own[0], kind="stable")]
            if kept:
                own = np.concatenate([kept.pop(), own], axis=1)
            else:
                kept.append(own[:, :1])
            moved = np.diff(own[1])
            goes = np.flatnonzero(np.abs(moved) > still[k])
            ways = np.append(self._way[k], np.sign(moved[goes]))
            kept += [own[:, goes[ways[:-1] * ways[1:] < 0]], own[:, -1:]]
            self._way[k] = ways[-1] or self._way[k]

    def found(self, which: int) -> tuple[FloatArray, FloatArray]:
        """Instants (k,) s, in order, and values (k,), from the first to the last that was taken."""
        time, value = np.concatenate([np.zeros((2, 0)), *self._kept[which]], axis=1)
        return time, value


def _rows(nodes: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Chebyshev's first `count` polynomials at nodes, and their slopes per step, (n, count)."""
    x = 2 * nodes - 1
    at = np.asarray(chebyshev.chebvander(x, count - 1), dtype=np.float64)
    slopes = chebyshev.chebval(x, chebyshev.chebder(np.eye(count), scl=2))
    return at, np.asarray(slopes, dtype=np.float64).T
