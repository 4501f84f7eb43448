"""The integral of a function of time, to rounding: Chebyshev polynomials of short pieces.

Pieces are halved until the last coefficients of the function on them are rounding, as in Chebfun
(Z. Battles and L. N. Trefethen, SIAM J. Sci. Comput. 25 (2004) 1743). They are made as they are
needed and kept: a step asks for the same instants again and again. What a piece's values do not
show, such as a pulse between them, has knots of its own.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.polynomial import chebyshev

from exudyn_flexlink.arrays import FloatArray

DEGREE = 16
NODES = chebyshev.chebpts1(DEGREE + 1)
FROM_VALUES = np.linalg.inv(chebyshev.chebvander(NODES, DEGREE))
TAIL = 3  # coefficients that must be rounding
RESOLVED = 1e-15  # of the largest coefficient so far
FIRST = 1.0  # s, length of the first piece tried
SHORTEST = 1e-6  # of the time, or of the first piece: what bends there adds no error worth a word


class Antiderivative:
    """Integral of `function` from 0 on; it may bend at `knots` (s) without being halved there."""

    def __init__(self, function: Callable[[float], float], knots: Iterable[float] = ()) -> None:
        self._function = function
        self._knots = sorted(time for time in knots if time > 0)
        self._ends = [0.0]
        self._sums = [0.0]
        self._pieces: list[list[float]] = []
        self._length = FIRST
        self._largest = 0.0

    def __call__(self, time: float) -> float:
        """Integral from 0 to `time` (s), which is not negative."""
        if time <= 0:
            return time * self._function(0.0)
        while self._ends[-1] < time:
            self._add_piece()
        k = bisect_left(self._ends, time) - 1
        begin, end = self._ends[k], self._ends[k + 1]
        return self._sums[k] + _clenshaw(self._pieces[k], (2 * time - begin - end) / (end - begin))

    def _add_piece(self) -> None:
        begin = self._ends[-1]
        k = bisect_right(self._knots, begin * (1 + 1e-15))
        next_knot = self._knots[k] if k < len(self._knots) else np.inf
        end = begin + self._length
        while True:
            end = min(end, next_knot)
            coefficients = self._interpolated(begin, end)
            self._largest = max(self._largest, float(np.abs(coefficients).max()))
            tail = float(np.abs(coefficients[-TAIL:]).max())
            short = end - begin <= SHORTEST * max(begin, FIRST)
            rounding = RESOLVED * (self._largest + self._blur(coefficients, begin, end))
            if short or tail <= rounding:
                break
            end = begin + (end - begin) / 2
        self._length = 2 * (end - begin)
        whole = chebyshev.chebint(coefficients, lbnd=-1) * ((end - begin) / 2)
        self._pieces.append(whole.tolist())
        self._ends.append(end)
        self._sums.append(self._sums[-1] + _clenshaw(self._pieces[-1], 1.0))

    def _blur(self, coefficients: FloatArray, begin: float, end: float) -> float:
        """How much the function changes with a time that is rounded, over that rounding."""
        steepest = float(np.abs(chebyshev.chebder(coefficients)).sum()) * 2 / (end - begin)
        return steepest * end

    def _interpolated(self, begin: float, end: float) -> FloatArray:
        """Coefficients of the polynomial through the function's values within a piece."""
        places = (begin + end) / 2 + (end - begin) / 2 * NODES
        return np.asarray(FROM_VALUES @ [self._function(time) for time in places.tolist()])


def _clenshaw(coefficients: Sequence[float], x: float) -> float:
    """Sum of Chebyshev polynomials at x."""
    one = other = 0.0
    for c in coefficients[:0:-1]:
        one, other = 2 * x * one - other + c, one
    return x * one - other + coefficients[0]
