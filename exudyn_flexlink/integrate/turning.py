"""Where quantities turn within the steps of a run: numerics, no mechanics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import chebyshev

from exudyn_flexlink.arrays import FloatArray, IndexArray

Turns = tuple[IndexArray, FloatArray, FloatArray]

LOOKS = (9, 9, 9)  # on a stretch and, twice, on what is left around the highest of them
ROUNDING = 1e-12  # of a value: what moves by less in a step stands still


def highest(
    value: Callable[[FloatArray], FloatArray],
    low: FloatArray,
    high: FloatArray,
    looks: tuple[int, ...] = LOOKS,
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


def chebyshev_sum(coefficients: list[float], part: float) -> float:
    """Sum of Chebyshev's polynomials at a part of the step (Clenshaw): faster, of one place."""
    x = 4 * part - 2
    one = two = 0.0
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
        self._inverse = np.linalg.inv(np.vstack([at, slope]))
        at, slope = _rows(nodes, count)
        self._slopes = slope @ np.linalg.inv(at)

    def slopes(self, values: FloatArray) -> FloatArray:
        """Slopes per step (m, n, c) of the polynomials through values (m, n, c) alone."""
        return np.asarray(np.einsum("ij,mjc->mic", self._slopes, values))

    def coefficients(self, values: FloatArray, slopes: FloatArray) -> FloatArray:
        """Coefficients (c, 2 n) from values (c, n) and slopes per step (c, n)."""
        return np.asarray(np.concatenate([values, slopes], axis=1) @ self._inverse.T)

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
        self._kept: list[Turns] = []
        # Where the last step ended, with values and slopes there, and slopes at the node before.
        self._time = 0.0
        self._last: tuple[FloatArray, FloatArray, FloatArray] | None = None
        self._all = np.arange(count)

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
        if self._last is None:
            self._keep(self._all, np.full(len(self._all), time[0]), values[0, 0])
            self._last = values[0, 0], slopes[0, 0], np.zeros(len(self._all))
        self._keep(*polynomial.turns(time, length, values, slopes))
        self._rests(time[:, None] + polynomial.nodes * length[:, None], values, slopes)
        self._between(time, self._last, (values, slopes), still)
        self._time = float(time[-1] + length[-1])
        self._last = values[-1, -1], slopes[-1, -1], slopes[-1, -2]

    def found(self, which: int) -> tuple[FloatArray, FloatArray]:
        """Instants (k,) s, in order, and values (k,), from the first to the last that was taken."""
        kept = list(self._kept)
        if self._last is not None:
            kept.append((self._all, np.full(len(self._all), self._time), self._last[0]))
        times = np.concatenate([np.zeros(0), *(time[of == which] for of, time, _ in kept)])
        values = np.concatenate([np.zeros(0), *(value[of == which] for of, _, value in kept)])
        order = np.argsort(times, kind="stable")
        return times[order], values[order]

    def _keep(self, which: IndexArray, time: FloatArray, value: FloatArray) -> None:
        if len(which):
            self._kept.append((which, time, value))

    def _rests(self, time: FloatArray, values: FloatArray, slopes: FloatArray) -> None:
        """Keep nodes inside steps, at `time` (m, n) s, at which what moves beside them stands."""
        moves = slopes != 0
        rest = ~moves[:, 1:-1] & (moves[:, :-2] | moves[:, 2:])
        step, node, which = np.nonzero(rest)
        self._keep(which, time[step, node + 1], values[step, node + 1, which])

    def _between(
        self,
        time: FloatArray,
        last: tuple[FloatArray, FloatArray, FloatArray],
        steps: tuple[FloatArray, FloatArray],
        still: FloatArray,
    ) -> None:
        """Keep both sides of where a step ends and the next begins, if a value or a rate jumps.

        Once, where what has moved stands on both sides: it may turn right there.
        """
        values, slopes = steps
        before, rising, risen = (
            np.concatenate([end[None], own])
            for end, own in zip(
                last, (values[:-1, -1], slopes[:-1, -1], slopes[:-1, -2]), strict=True
            )
        )
        after, then = values[:, 0], slopes[:, 0]
        turned = (rising * then <= 0) & ((rising != 0) | (then != 0))
        jumps = turned | (np.abs(after - before) > still)
        rests = (risen != 0) & (rising == 0) & (then == 0)
        step, which = np.nonzero(jumps)
        self._keep(which, time[step], before[step, which])
        step, which = np.nonzero(jumps | rests)
        self._keep(which, time[step], after[step, which])


def _rows(nodes: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Chebyshev's first `count` polynomials at nodes, and their slopes per step, (n, count)."""
    x = 2 * nodes - 1
    at = np.asarray(chebyshev.chebvander(x, count - 1), dtype=np.float64)
    slopes = chebyshev.chebval(x, chebyshev.chebder(np.eye(count), scl=2))
    return at, np.asarray(slopes, dtype=np.float64).T
