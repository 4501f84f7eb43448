"""The place of a convex curve that is farthest in a direction: there a straight face lies on it."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves.base import Curve
from exudyn_flexlink.curves.closest import NEWTON_STEPS, ROUNDING, Closest

STRAIGHT = 1e-6  # curvature times size: less is a straight stretch
FINER = 8  # than the samples of a curve: where its curvature is looked at


class Farthest(Closest):
    """As `Closest`, but x, y are a direction (unit vector) in which the curve reaches farthest."""

    def __init__(self, curve: Curve) -> None:
        super().__init__(curve)
        self._shifts = [
            float(b) - p.start for b, p in zip(curve.breaks[:-1], curve.pieces, strict=True)
        ]

    def parameters(self, directions: FloatArray) -> FloatArray:
        """Parameters (...) of the whole curve, by directions (..., 2)."""
        flat = [self.on_curve(x, y) for x, y in directions.reshape(-1, 2).tolist()]
        found = [u + self._shifts[piece] for piece, u in flat]
        return np.array(found).reshape(directions.shape[:-1])

    def _nearest(self, x: float, y: float) -> int:
        return int(np.argmax(self._x * x + self._y * y))

    def _slope(self, piece: int, u: float, x: float, y: float) -> float:
        return self._fall(piece, u, x, y)[0]

    def _fall(self, piece: int, u: float, x: float, y: float) -> tuple[float, float]:
        _, _, dx, dy, ddx, ddy = self.at[piece](u)
        return -(dx * x + dy * y), -(ddx * x + ddy * y)

    def _foot(self, piece: int, x: float, y: float, near: float) -> float:
        """By Newton's method; beyond its end a piece goes on as a conic, or as its last cubic."""
        u = near
        for _ in range(NEWTON_STEPS):
            slope, growth = self._fall(piece, u, x, y)
            step = slope / growth if growth > 0 else 0.0
            u -= step
            if abs(step) <= ROUNDING * (1 + abs(u)):
                break
        return u


def is_convex(curve: Curve) -> bool:
    """Tell whether a curve is closed, and bends one way everywhere, with no straight stretch."""
    if not curve.closed:
        return False
    u = np.unique(np.concatenate([curve.samples[0], curve.breaks]))
    u = np.unique(u[:-1, None] + np.diff(u)[:, None] * np.arange(FINER) / FINER)
    bends = curve.curvature(u) * curve.size
    one_way = bends.min() > STRAIGHT or bends.max() < -STRAIGHT
    # What bends one way but turns twice crosses itself.
    ways = np.unwrap(np.arctan2(*curve.tangent(np.append(u, curve.end)).T[::-1]))
    return bool(one_way and abs(ways[-1] - ways[0]) < 3 * np.pi)
