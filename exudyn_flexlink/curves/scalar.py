"""One place on one smooth piece, in plain floats: for loops that ask step by step.

Numpy costs tens of microseconds for a single place; these functions cost about one. They continue
a piece beyond its ends (conics and lines as they are, splines by their last cubic).
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from math import cos, sin

from exudyn_flexlink.curves.base import Curve
from exudyn_flexlink.curves.pieces import Arc, LineSegment
from exudyn_flexlink.curves.spline import Spline, SplinePiece

Place = tuple[float, float, float, float, float, float]
Evaluator = Callable[[float], Place]
"""u -> x, y, dx/du, dy/du, d2x/du2, d2y/du2."""

NEWTON_STEPS = 20


def evaluator(piece: Curve) -> Evaluator:
    """Return the function that evaluates a smooth piece at its own parameter.

    Raises:
        TypeError: the curve is not a single smooth piece.

    """
    if isinstance(piece, Arc):
        return _arc(piece)
    if isinstance(piece, LineSegment):
        return _line(piece)
    if isinstance(piece, (Spline, SplinePiece)):
        return _spline(piece if isinstance(piece, Spline) else piece.spline)
    raise TypeError(f"not a smooth piece: {type(piece).__name__}")


def foot(at: Evaluator, x: float, y: float, u: float, steps: int = NEWTON_STEPS) -> float:
    """Parameter of the place next to (x, y), by at most `steps` of Newton from `u`."""
    for _ in range(steps):
        px, py, dx, dy, ddx, ddy = at(u)
        rx, ry = px - x, py - y
        slope = rx * dx + ry * dy
        speed = dx * dx + dy * dy
        bend = speed + rx * ddx + ry * ddy
        # Beyond the centre of curvature the foot is a maximum: fall back on the first-order step.
        step = slope / (bend if bend > 0.1 * speed else speed)
        u -= step
        if step * step * speed < 1e-30:  # 1e-15 m
            break
    return u


def _arc(piece: Arc) -> Evaluator:
    (cx, cy), (ax, ay), (bx, by) = (vector.tolist() for vector in piece.conic)

    def at(u: float) -> Place:
        c, s = cos(u), sin(u)
        x, y = ax * c + bx * s, ay * c + by * s
        return cx + x, cy + y, bx * c - ax * s, by * c - ay * s, -x, -y

    return at


def _line(piece: LineSegment) -> Evaluator:
    (x0, y0), (x1, y1) = piece.a, piece.b
    tx, ty = (x1 - x0) / piece.end, (y1 - y0) / piece.end
    return lambda u: (x0 + tx * u, y0 + ty * u, tx, ty, 0.0, 0.0)


def _spline(spline: Spline) -> Evaluator:
    knots, spans = spline.cubics()
    last, closed, period = len(spans) - 1, spline.closed, spline.period

    def at(u: float) -> Place:
        if closed:
            u = u % period
        index = min(max(bisect_right(knots, u) - 1, 0), last)
        w = u - knots[index]
        (x3, y3), (x2, y2), (x1, y1), (x0, y0) = spans[index]
        return (
            ((x3 * w + x2) * w + x1) * w + x0,
            ((y3 * w + y2) * w + y1) * w + y0,
            (3 * x3 * w + 2 * x2) * w + x1,
            (3 * y3 * w + 2 * y2) * w + y1,
            6 * x3 * w + 2 * x2,
            6 * y3 * w + 2 * y2,
        )

    return at
