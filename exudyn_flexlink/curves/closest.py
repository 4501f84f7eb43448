"""The place of a curve next to a point, and how far along the curve it is, in plain floats.

It is for loops that ask step by step. A search over the whole curve starts at the nearest sample;
one on a single piece continues that piece beyond its ends, so that what follows a point along the
piece stays smooth there.
"""

from __future__ import annotations

from bisect import bisect_right
from itertools import pairwise
from math import hypot

import numpy as np

from exudyn_flexlink.curves.arc_length import NODES, WEIGHTS
from exudyn_flexlink.curves.base import Curve
from exudyn_flexlink.curves.scalar import Evaluator, evaluator, foot

ROUNDS = 60  # of halving: to rounding
ROUNDING = 1e-15
# Parts of a stretch, and their shares of an integral over it (Gauss).
QUADRATURE = list(zip((0.5 * (1 + NODES)).tolist(), (0.5 * WEIGHTS).tolist(), strict=True))


class Closest:
    """Searches a curve; places are pieces with their own parameters."""

    def __init__(self, curve: Curve) -> None:
        self._closed = curve.closed
        self.at: list[Evaluator] = [evaluator(piece) for piece in curve.pieces]
        u, points = curve.samples
        self._x, self._y = points[:, 0].copy(), points[:, 1].copy()
        self._bounds = [(piece.start, piece.end) for piece in curve.pieces]
        self._spans = [_span(curve, float(low), float(high)) for low, high in pairwise(u)]
        # Of each piece: where its spans begin, and how long the curve is up to there.
        self._marks: list[tuple[list[float], list[float]]] = [([], []) for _ in curve.pieces]
        lengths = curve.arc_length.to(u[:-1]).tolist()
        for (piece, low, _), length in zip(self._spans, lengths, strict=True):
            self._marks[piece][0].append(low)
            self._marks[piece][1].append(length)

    def on_curve(self, x: float, y: float) -> tuple[int, float]:
        """Piece and parameter of the place next to (x, y) m, never beyond an open curve's end."""
        return self._around(self._nearest(x, y), x, y)

    def on_piece(self, piece: int, x: float, y: float, near: float) -> float:
        """Parameter of the place of a piece next to (x, y) m, also beyond its ends.

        Beyond them it is searched from the end, or from `near` where another piece comes next. On
        the piece Newton's method is kept between samples: a roller that hardly has room in a hollow
        is so near the centre of curvature that it would not get there by itself.
        """
        i, count = self._nearest(x, y), len(self._spans)
        found, u = self._around(i, x, y)
        if found == piece and self._bounds[piece][0] < u < self._bounds[piece][1]:
            return u
        sampled, start, _ = self._spans[i % count if self._closed else min(i, count - 1)]
        return foot(self.at[piece], x, y, start if sampled == piece else near)

    def length_to(self, piece: int, u: float) -> float:
        """Length (m) along the curve to a place of a piece, which goes on beyond its ends."""
        begins, lengths = self._marks[piece]
        i = max(bisect_right(begins, u) - 1, 0)
        begin, at = begins[i], self.at[piece]
        whole = 0.0
        for node, weight in QUADRATURE:
            _, _, dx, dy, _, _ = at(begin + node * (u - begin))
            whole += weight * hypot(dx, dy)
        return lengths[i] + whole * (u - begin)

    def _around(self, i: int, x: float, y: float) -> tuple[int, float]:
        """Piece and parameter of the place next to (x, y) m, searched around a sample."""
        count = len(self._spans)
        if self._closed:
            i %= count  # the last sample is the first one again
        if i < count:
            piece, low, high = self._spans[i]
            if self._slope(piece, low, x, y) < 0:
                return piece, self._settle(self._spans[i], x, y)
            if i == 0 and not self._closed:
                return piece, low
        piece, low, high = self._spans[i - 1]
        if self._slope(piece, high, x, y) < 0:
            return piece, high
        return piece, self._settle(self._spans[i - 1], x, y)

    def _nearest(self, x: float, y: float) -> int:
        dx, dy = self._x - x, self._y - y
        return int(np.argmin(dx * dx + dy * dy))

    def _slope(self, piece: int, u: float, x: float, y: float) -> float:
        """Half the derivative of the squared distance."""
        px, py, dx, dy, _, _ = self.at[piece](u)
        return (px - x) * dx + (py - y) * dy

    def _settle(self, span: tuple[int, float, float], x: float, y: float) -> float:
        """Zero of the slope within a span: by Newton, by halves where that goes astray."""
        piece, low, high = span
        u, near = 0.5 * (low + high), ROUNDING * (1 + abs(low) + abs(high))
        for _ in range(ROUNDS):
            px, py, dx, dy, ddx, ddy = self.at[piece](u)
            slope = (px - x) * dx + (py - y) * dy
            growth = dx * dx + dy * dy + (px - x) * ddx + (py - y) * ddy
            low, high = (u, high) if slope < 0 else (low, u)
            following = u - slope / growth if growth > 0 else low - 1.0
            if not low <= following <= high:
                following = 0.5 * (low + high)
            if abs(following - u) <= near:
                return following
            u = following
        return u


def _span(curve: Curve, low: float, high: float) -> tuple[int, float, float]:
    """Piece between two samples of a curve, and its own parameter there."""
    number, _ = curve.locate(0.5 * (low + high))
    shift = curve.pieces[number].start - float(curve.breaks[number])
    return number, low + shift, high + shift
