"""The place of a curve nearest to a point, and its arc length, in plain floats.

This is for loops over steps: numpy needs tens of microseconds for a single place, these functions
about one. A search over the whole curve starts at the nearest sample. A search on a single piece
continues the piece beyond its ends (conics and lines as they are, splines by their last cubic), so
that the place stays smooth there.

`Farthest` finds the place of a convex curve that is farthest in a direction: a straight face
touches it there. `reach` is the distance from a curve within which the nearest place is unique.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise
from math import atan2, cos, hypot, remainder, sin, tau

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves.base import HALVINGS, NODES, WEIGHTS, Curve
from exudyn_flexlink.curves.pieces import Arc, LineSegment, Spline, SplinePiece
from exudyn_flexlink.curves.rounding import CornerArc
from exudyn_flexlink.rounding import UNIT_ROUNDING

Place = tuple[float, float, float, float, float, float]
Evaluator = Callable[[float], Place]
"""u -> x, y, dx/du, dy/du, d2x/du2, d2y/du2."""

NEWTON_STEPS = 20
# Points of an interval, and their weights in an integral over it (Gauss).
QUADRATURE = list(zip((0.5 * (1 + NODES)).tolist(), (0.5 * WEIGHTS).tolist(), strict=True))


class Closest:
    """Searches a curve; a place is a piece and a parameter on it.

    On a curve with corners, the nearest sample and the nearest place may be on different sides.
    Then all intervals between samples that may be nearer are searched.
    """

    def __init__(self, curve: Curve) -> None:
        self._closed = curve.closed
        self.at: list[Evaluator] = [evaluator(piece) for piece in curve.pieces]
        self._direct = [_direct(piece) for piece in curve.pieces]
        self._speeds = [_even_speed(piece) for piece in curve.pieces]
        self.cornered = any(isinstance(piece, CornerArc) for piece in curve.pieces)
        u, points = curve.samples
        self._x, self._y = points[:, 0].copy(), points[:, 1].copy()
        self._bounds = [(piece.start, piece.end) for piece in curve.pieces]
        self._shifts = [
            float(b) - p.start for b, p in zip(curve.breaks[:-1], curve.pieces, strict=True)
        ]
        self._spans = [_span(curve, float(low), float(high)) for low, high in pairwise(u)]
        # For each piece: parameters at which its spans begin, and the arc lengths there.
        self._marks: list[tuple[list[float], list[float]]] = [([], []) for _ in curve.pieces]
        lengths = curve.arc_length.to(u)
        self._halves = 0.5 * np.diff(lengths)
        for (piece, low, _), length in zip(self._spans, lengths[:-1].tolist(), strict=True):
            self._marks[piece][0].append(low)
            self._marks[piece][1].append(length)

    def on_curve(self, x: float, y: float) -> tuple[int, float]:
        """Piece and parameter of the place nearest to (x, y), m; never beyond an end."""
        place = self._around(self._nearest(x, y), x, y)
        return self._nearer(place, x, y) if self.cornered else place

    def _nearer(self, place: tuple[int, float], x: float, y: float) -> tuple[int, float]:
        """Return a nearer place of the curve than `place`, if any."""
        least, away = self._away(place, x, y), np.hypot(self._x - x, self._y - y)
        for k in np.flatnonzero(np.minimum(away[:-1], away[1:]) - self._halves < least).tolist():
            piece, low, high = self._spans[k]
            if self._slope(piece, low, x, y) < 0 < self._slope(piece, high, x, y):
                other = piece, self._settle(self._spans[k], x, y)
                if (distance := self._away(other, x, y)) < least:
                    place, least = other, distance
        return place

    def _away(self, place: tuple[int, float], x: float, y: float) -> float:
        piece, u = place
        values = self.at[piece](u)
        return hypot(values[0] - x, values[1] - y)

    def parameters(self, points: FloatArray) -> FloatArray:
        """Parameters (...) of the whole curve nearest to points (..., 2)."""
        flat = [self.on_curve(x, y) for x, y in points.reshape(-1, 2).tolist()]
        places = [u + self._shifts[piece] for piece, u in flat]
        return np.array(places).reshape(points.shape[:-1])

    def on_piece(self, piece: int, x: float, y: float, near: float) -> float:
        """Parameter of the place of a piece nearest to (x, y), m, also beyond its ends.

        Beyond an end the search starts at the end, or at `near` if another piece follows. On the
        piece Newton's method stays between samples. Otherwise it fails near the centre of
        curvature, for example with a roller that has little room in a hollow.
        """
        direct = self._direct[piece]
        if direct is not None:
            return direct(x, y, near)
        i, count = self._nearest(x, y), len(self._spans)
        on, u = self._around(i, x, y)
        if on == piece and self._bounds[piece][0] < u < self._bounds[piece][1]:
            return u
        sampled, start, _ = self._spans[i % count if self._closed else min(i, count - 1)]
        return self._foot(piece, x, y, start if sampled == piece else near)

    def length_to(self, piece: int, u: float) -> float:
        """Arc length (m) of the curve up to a place of a piece, also beyond its ends."""
        begins, lengths = self._marks[piece]
        speed = self._speeds[piece]
        if speed is not None:
            return lengths[0] + speed * (u - begins[0])
        i = max(bisect_right(begins, u) - 1, 0)
        begin, evaluator = begins[i], self.at[piece]
        whole = 0.0
        for node, weight in QUADRATURE:
            _, _, dx, dy, _, _ = evaluator(begin + node * (u - begin))
            whole += weight * hypot(dx, dy)
        return lengths[i] + whole * (u - begin)

    def _around(self, i: int, x: float, y: float) -> tuple[int, float]:
        """Piece and parameter of the place nearest to (x, y), m, searched around a sample."""
        count = len(self._spans)
        if self._closed:
            i %= count  # the last sample is the same as the first
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
        return int((dx * dx + dy * dy).argmin())

    def _slope(self, piece: int, u: float, x: float, y: float) -> float:
        """Half the derivative of the squared distance."""
        px, py, dx, dy, _, _ = self.at[piece](u)
        return (px - x) * dx + (py - y) * dy

    def _fall(self, piece: int, u: float, x: float, y: float) -> tuple[float, float]:
        """Slope, and its derivative."""
        px, py, dx, dy, ddx, ddy = self.at[piece](u)
        growth = dx * dx + dy * dy + (px - x) * ddx + (py - y) * ddy
        return (px - x) * dx + (py - y) * dy, growth

    def _foot(self, piece: int, x: float, y: float, near: float) -> float:
        return foot(self.at[piece], x, y, near)

    def _settle(self, span: tuple[int, float, float], x: float, y: float) -> float:
        """Zero of the slope within a span, by Newton's method with bisection."""
        piece, low, high = span
        u, near = 0.5 * (low + high), UNIT_ROUNDING * (1 + abs(low) + abs(high))
        for _ in range(HALVINGS):
            slope, growth = self._fall(piece, u, x, y)
            low, high = (u, high) if slope < 0 else (low, u)
            following = u - slope / growth if growth > 0 else low - 1.0
            if not low <= following <= high:
                following = 0.5 * (low + high)
            if abs(following - u) <= near:
                return following
            u = following
        return u


def _span(curve: Curve, low: float, high: float) -> tuple[int, float, float]:
    """Piece between two samples of a curve, and its parameters at both."""
    number, _ = curve.locate(0.5 * (low + high))
    shift = curve.pieces[number].start - float(curve.breaks[number])
    return number, low + shift, high + shift


# --- one place on one piece ------------------------------------------------------------


def evaluator(piece: Curve) -> Evaluator:
    """Return the function that evaluates a smooth piece at its own parameter.

    A piece without a formula in this module is evaluated by its method, which takes ten times as
    long.
    """
    if isinstance(piece, Arc):
        return _arc(piece)
    if isinstance(piece, LineSegment):
        return _line(piece)
    if isinstance(piece, (Spline, SplinePiece)):
        return _spline(piece if isinstance(piece, Spline) else piece.spline)
    return _by_itself(piece)


def _direct(piece: Curve) -> Callable[[float, float, float], float] | None:
    """Return a function for the place of a piece nearest to (x, y), also beyond its ends.

    It needs no search; None for pieces that need one. On a circle the place is on the piece, or
    else less than half a turn from the third argument.
    """
    if isinstance(piece, LineSegment):
        (x0, y0), (x1, y1) = piece.a, piece.b
        tx, ty = (x1 - x0) / piece.end, (y1 - y0) / piece.end
        return lambda x, y, _: tx * (x - x0) + ty * (y - y0)
    if isinstance(piece, Arc) and piece.semi_axes[0] == abs(piece.semi_axes[1]):
        (cx, cy), middle = piece.centre, 0.5 * (piece.start + piece.end)
        way = 1.0 if piece.semi_axes[1] > 0 else -1.0

        def on_circle(x: float, y: float, near: float) -> float:
            angle = way * (atan2(y - cy, x - cx) - piece.rotation)
            u = middle + remainder(angle - middle, tau)
            return u if piece.start <= u <= piece.end else near + remainder(angle - near, tau)

        return on_circle
    return None


def _even_speed(piece: Curve) -> float | None:
    """Arc length (m) by the parameter, if it is the same all along the piece; else None."""
    if isinstance(piece, LineSegment):
        return 1.0
    if isinstance(piece, Arc) and piece.semi_axes[0] == abs(piece.semi_axes[1]):
        return piece.semi_axes[0]
    return None


def foot(evaluator: Evaluator, x: float, y: float, u: float, steps: int = NEWTON_STEPS) -> float:
    """Parameter of the place nearest to (x, y), by at most `steps` Newton steps from `u`."""
    for _ in range(steps):
        px, py, dx, dy, ddx, ddy = evaluator(u)
        rx, ry = px - x, py - y
        slope = rx * dx + ry * dy
        speed = dx * dx + dy * dy
        bend = speed + rx * ddx + ry * ddy
        # Beyond the centre of curvature the zero is a maximum, so a first-order step is made.
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


def _by_itself(piece: Curve) -> Evaluator:
    def at(u: float) -> Place:
        places = piece.places(np.float64(u))
        place, first, second = (complex(number) for number in places)
        return place.real, place.imag, first.real, first.imag, second.real, second.imag

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


STRAIGHT = 1e-6  # curvature times size: with less a curve counts as straight
FINER = 16  # curvatures evaluated per sample: this shows their peaks to 4 digits


class Farthest(Closest):
    """As `Closest`, but x, y are a direction (unit vector) in which the curve reaches farthest."""

    def __init__(self, curve: Curve) -> None:
        super().__init__(curve)
        self._direct = [None] * len(curve.pieces)

    def _nearest(self, x: float, y: float) -> int:
        return int((self._x * x + self._y * y).argmax())

    def _slope(self, piece: int, u: float, x: float, y: float) -> float:
        return self._fall(piece, u, x, y)[0]

    def _fall(self, piece: int, u: float, x: float, y: float) -> tuple[float, float]:
        _, _, dx, dy, ddx, ddy = self.at[piece](u)
        return -(dx * x + dy * y), -(ddx * x + ddy * y)

    def _foot(self, piece: int, x: float, y: float, near: float) -> float:
        """Place by Newton's method; beyond its end a piece continues as a conic or last cubic."""
        u = near
        for _ in range(NEWTON_STEPS):
            slope, growth = self._fall(piece, u, x, y)
            step = slope / growth if growth > 0 else 0.0
            u -= step
            if abs(step) <= UNIT_ROUNDING * (1 + abs(u)):
                break
        return u


def finer(grid: FloatArray) -> FloatArray:
    """Parameters (m,) at and between which the curvature of a curve is evaluated."""
    steps = np.arange(FINER) / FINER
    return np.append((grid[:-1, None] + np.diff(grid)[:, None] * steps).ravel(), grid[-1])


def is_convex(curve: Curve) -> bool:
    """Tell whether a curve is closed and its curvature has one sign and is nowhere zero."""
    if not curve.closed:
        return False
    u = finer(np.unique(np.concatenate([curve.samples[0], curve.breaks])))[:-1]
    bends = curve.curvature(u) * curve.size
    one_way = bends.min() > STRAIGHT or bends.max() < -STRAIGHT
    # If its curvature has one sign and it turns twice, a closed curve crosses itself.
    ways = np.unwrap(np.arctan2(*curve.tangent(np.append(u, curve.end)).T[::-1]))
    return bool(one_way and abs(ways[-1] - ways[0]) < 3 * np.pi)


MOST_SAMPLES = 500  # samples of a curve for the search of a neck


def reach(curve: Curve, side: float, radius: float) -> float:
    """Smallest radius (m) of the path of a roller's centre along one side of a curve.

    `side` is 1 on the left of the curve, -1 on its right; `radius` (m) is the roller's, 0 for a
    point. Half the width of a neck counts as a radius. The result is 0 if the roller does not fit
    everywhere.
    H. Federer, Curvature measures, Trans. Amer. Math. Soc. 93 (1959) 418, theorem 4.18.
    """
    u = curve.samples[0]
    last = -1 if curve.closed else None
    u = u[: last : 1 + len(u) // MOST_SAMPLES]
    point, tangent = curve.point(u) @ [1, 1j], curve.tangent(u) @ [1, 1j]
    between = point - point[:, None]
    seen = between * tangent.conj()[:, None]
    across = np.abs(seen.imag)
    if not curve.closed:  # an open curve has no tangent beyond its ends
        before, after = seen[0].real < 0, seen[-1].real > 0
        across[0] = np.where(before, np.abs(seen[0]), across[0])
        across[-1] = np.where(after, np.abs(seen[-1]), across[-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = np.sign(side * seen.imag) * radius
        radii = np.abs(between) ** 2 / (2 * across) - inside
        np.fill_diagonal(radii, np.inf)
        bend = side * curve.curvature(u)
        within = np.sign(bend) * radius
        bends = 1 / np.abs(bend) - within
    least = min(float(radii.min()), float(bends.min()))
    return max(0.0, least)
