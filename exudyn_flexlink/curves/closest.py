"""The place of a curve next to a point, in plain floats: for loops that ask step by step.

A search over the whole curve starts at the nearest sample; one on a single piece continues that
piece beyond its ends, so that what follows a point along the piece stays smooth there.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.curves.base import Curve
from exudyn_flexlink.curves.scalar import Evaluator, evaluator, foot


class Closest:
    """Searches a curve; places are pieces with their own parameters."""

    def __init__(self, curve: Curve) -> None:
        self._curve = curve
        self.at: list[Evaluator] = [evaluator(piece) for piece in curve.pieces]
        u, points = curve.samples
        self._x, self._y = points[:, 0].copy(), points[:, 1].copy()
        self._places = [curve.locate(float(value)) for value in u]

    def on_curve(self, x: float, y: float) -> tuple[int, float]:
        """Piece and parameter of the place next to (x, y) m, never beyond an open curve's end."""
        piece, start = self._sample(x, y)
        u = foot(self.at[piece], x, y, start)
        own = self._curve.pieces[piece]
        if own.start <= u <= own.end or (len(self.at) == 1 and self._curve.closed):
            return piece, u
        way = 1 if u > own.end else -1
        after = piece + way
        if self._curve.closed:
            after %= len(self.at)
        end = own.end if way > 0 else own.start
        if not 0 <= after < len(self.at):
            return piece, end
        other = self._curve.pieces[after]
        begin = other.start if way > 0 else other.end
        u = foot(self.at[after], x, y, begin)
        if way * (u - begin) <= 0:  # the foot is where both meet
            return piece, end
        return after, min(max(u, other.start), other.end)

    def on_piece(self, piece: int, x: float, y: float, near: float) -> float:
        """Parameter of the place of a piece next to (x, y) m, also beyond its ends.

        Searched from the nearest sample, or from `near` where that is on another piece.
        """
        sampled, start = self._sample(x, y)
        return foot(self.at[piece], x, y, start if sampled == piece else near)

    def _sample(self, x: float, y: float) -> tuple[int, float]:
        dx, dy = self._x - x, self._y - y
        return self._places[int(np.argmin(dx * dx + dy * dy))]
