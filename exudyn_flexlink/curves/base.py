"""What every plane curve can do, and how a curve made of several pieces does it.

Lengths are in m, angles in rad. Curvature is in 1/m, positive where the curve bends to the left. A
curve has a parameter range ``start <= u <= end`` and smooth pieces over it. The parameter is an
angle on one piece and a length on another, so ``|dP/du|`` jumps where pieces meet. The direction
does not jump.

At a foot point the distance from a point q to a curve is smallest. The sign of
``g(u) = (P - q) . dP/du`` tells in which direction the distance falls. g is continuous, except for
positive jumps at the breaks. So the search is Newton's method within brackets: this needs no
smoothness where pieces meet.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.rounding import NEGLIGIBLE

MOST_CANDIDATES = 16
AT_ONCE = 4096  # points whose distances from all samples are held in memory together
HALVINGS = 60  # of a searched range: down to rounding


def candidates(curve: Curve, target: FloatArray) -> FloatArray:
    """Parameters of local minima of the distance to ``target`` (2,), the closest first.

    Only minima that can be the closest at this spacing of the samples. At most ``MOST_CANDIDATES``
    of them, since the centre of a circle has infinitely many.
    """
    points = curve.samples[1]
    lows = _sampled_minima(curve, np.linalg.norm(points - target, axis=1), points)
    feet = curve.wrap(_settled(curve, target, *_around(curve, lows)))
    distances = np.linalg.norm(curve.point(feet) - target, axis=1)
    return np.asarray(feet[np.argsort(distances, kind="stable")])


def closest(curve: Curve, targets: FloatArray) -> FloatArray:
    """Parameters (...), within the range, of the places closest to `targets` (..., 2)."""
    points, feet = targets.reshape(-1, 2), [np.empty(0)]
    for first in range(0, len(points), AT_ONCE):
        some = points[first : first + AT_ONCE]
        away = some[:, None] - curve.samples[1]
        nearest = np.argmin(np.sum(away * away, axis=-1), axis=1)
        feet.append(curve.wrap(_settled(curve, some, *_around(curve, nearest))))
    return np.concatenate(feet).reshape(targets.shape[:-1])


def _around(curve: Curve, i: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Parameters of samples, of the samples before them, and of those after them."""
    grid, _ = curve.samples
    last = len(grid) - 1
    low, high = grid[np.maximum(i - 1, 0)], grid[np.minimum(i + 1, last)]
    if curve.closed:  # its last sample repeats the first
        low = np.where(i > 0, low, grid[-2] - curve.period)
        high = np.where(i < last, high, grid[1] + curve.period)
    return grid[i], low, high


def _settled(
    curve: Curve, targets: FloatArray, u: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Zeros (n,) of g between two parameters, by Newton's method from `u`, else by bisection.

    If g has only one sign there, an end of the interval.
    """
    for _ in range(HALVINGS):
        g, growth = _slope(curve, targets, u)
        low, high = np.where(g < 0, u, low), np.where(g < 0, high, u)
        with np.errstate(divide="ignore", invalid="ignore"):
            following = u - g / growth
        inside = (growth > 0) & (low <= following) & (following <= high)
        following = np.where(inside, following, 0.5 * (low + high))
        if np.all(abs(following - u) <= 1e-15 * np.maximum(abs(u), curve.period)):
            return following
        u = following
    return u


def _sampled_minima(curve: Curve, distance: FloatArray, points: FloatArray) -> IndexArray:
    ends = np.inf if not curve.closed else None
    before = np.concatenate([[ends or distance[-2]], distance[:-1]])
    after = np.concatenate([distance[1:], [ends or distance[1]]])
    # Between samples the distance changes by the arc length at most: twice a chord is enough.
    slack = 2 * np.max(np.linalg.norm(np.diff(points, axis=0), axis=1))
    low = (distance <= before) & (distance <= after) & (distance <= distance.min() + slack)
    if curve.closed:
        low[-1] = False  # the same place as the first sample
    index = np.flatnonzero(low)
    return np.asarray(index[np.argsort(distance[index], kind="stable")][:MOST_CANDIDATES])


def _slope(curve: Curve, targets: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``g`` and ``dg/du`` (n,) at u (n,)."""
    place, first, second = curve.derivatives(u)
    away = place - targets
    return np.sum(away * first, axis=-1), np.sum(first * first + away * second, axis=-1)


def descend(curve: Curve, target: FloatArray, near: float) -> float:
    """Go from ``near`` in the direction of falling distance to the next minimum."""
    g, growth = (float(number) for number in _slope(curve, target, np.float64(near)))
    if g == 0:
        return near
    down = -1 if g > 0 else 1
    # If near is close, as in time stepping, twice a Newton step brackets the foot at once.
    step = 2 * abs(g) / growth if growth > 0 else np.inf
    place = near
    while abs(place - near) <= curve.period:
        next_place = place + down * min(step, _to_next_sample(curve, place, down))
        if not curve.closed:
            next_place = min(max(next_place, curve.start), curve.end)
        if next_place == place:
            return place
        if _slope(curve, target, np.float64(next_place))[0] * down >= 0:
            low, high = np.sort([place, next_place])
            return float(_settled(curve, target, 0.5 * (low + high), low, high))
        place, step = next_place, 2 * step
    return place


def _to_next_sample(curve: Curve, u: float, down: int) -> float:
    """Step from u to the next sample, never over a break: behind it u may mean a length."""
    grid = curve.samples[0]
    aside = 1e-12 * curve.period
    wrapped = float(curve.wrap(u))
    if down > 0:
        following = int(np.searchsorted(grid, wrapped + aside, side="right"))
        return float(grid[following]) - wrapped if following < len(grid) else aside
    before = int(np.searchsorted(grid, wrapped - aside, side="left")) - 1
    return wrapped - float(grid[before]) if before >= 0 else aside


# m, and above 1 m a part of the size: typed decimals of the same point differ by less than this.
POSITION_TOLERANCE = 1e-9
DIRECTION_TOLERANCE = 1e-6
# POSITION_TOLERANCE allows a gap where pieces meet, and a line could slip through it. So pieces
# also report crossings beyond their ends, by this fraction of their range.
OVERLAP = 1e-7
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


class CurveError(Sendable, ValueError):
    """A curve that is impossible.

    ``message`` says what is wrong; it counts pieces, points and laps from 1. ``piece`` is the
    index, from 0, of the wrong piece, lap or point; None means the whole curve, or the value of
    ``key``. ``hint`` says what to do.
    """

    def __init__(
        self, message: str, piece: int | None = None, hint: str = "", key: str = ""
    ) -> None:
        super().__init__(message)
        self.message = message
        self.piece = piece
        self.hint = hint
        self.key = key


Places = tuple[ComplexArray, ComplexArray, ComplexArray]
"""P (m), dP/du and d2P/du2, each as x + i y (...)."""


class Knots(NamedTuple):
    """Places u (m,), increasing, inside pieces of a curve, where d3P/du3 jumps; jumps (m, 2)."""

    places: FloatArray
    jumps: FloatArray


@dataclass(frozen=True)
class Curve(ABC):
    """A plane curve P(u) with a continuous direction.

    Every method takes one ``u`` or an array of any shape ``(...)``; vectors have the shape
    ``(..., 2)``. A closed curve accepts every u and repeats with ``period``; an open one raises
    ValueError for u beyond its ends by more than rounding. A break belongs to the piece that begins
    there.

    ``pieces`` are the smooth pieces, and ``breaks`` (len(pieces) + 1) the values of u where they
    meet. Any derivative may jump at breaks, and the third at :attr:`knots`; elsewhere all are
    continuous.
    """

    start: float = field(init=False, repr=False, compare=False)
    end: float = field(init=False, repr=False, compare=False)
    closed: bool = field(init=False, repr=False, compare=False)
    pieces: tuple[Curve, ...] = field(init=False, repr=False, compare=False)
    breaks: FloatArray = field(init=False, repr=False, compare=False)

    def _range(self, start: float, end: float, closed: bool) -> None:
        """Set the range of a smooth piece, by `object.__setattr__` since the piece is frozen."""
        self._fill(closed=closed, pieces=(self,), breaks=np.array([start, end]))

    def _fill(self, closed: bool, pieces: tuple[Curve, ...], breaks: FloatArray) -> None:
        breaks.flags.writeable = False
        values = {"start": float(breaks[0]), "end": float(breaks[-1]), "closed": closed}
        for name, value in {**values, "pieces": pieces, "breaks": breaks}.items():
            object.__setattr__(self, name, value)

    @abstractmethod
    def places(self, u: FloatArray) -> Places:
        """Evaluate at u (...) inside the range; a smooth piece continues beyond its ends."""

    def _raw(self, u: FloatArray, order: int) -> FloatArray:
        """``order``-th derivative (0, 1, 2) at u inside the range, shape (..., 2)."""
        return as_vectors(self.places(u)[order])

    @abstractmethod
    def grid(self) -> FloatArray:
        """Values of u from start to end, with every break, dense enough to see the shape."""

    # --- geometry at a place ----------------------------------------------------------------

    @property
    def period(self) -> float:
        """Range of the parameter after which a closed curve repeats."""
        return self.end - self.start

    def wrap(self, u: ArrayLike) -> FloatArray:
        """Bring u into the parameter range.

        Raises:
            ValueError: the curve is open and u lies beyond an end.

        """
        values = np.asarray(u, dtype=float)
        if self.closed:
            return np.asarray(self.start + np.mod(values - self.start, self.period))
        slack = NEGLIGIBLE * self.period
        if np.any((values < self.start - slack) | (values > self.end + slack)):
            raise ValueError(
                f"the curve is open: its parameter runs from {self.start:.9g} to {self.end:.9g}, "
                f"got {values.min():.9g} to {values.max():.9g}"
            )
        return np.asarray(np.clip(values, self.start, self.end))

    def point(self, u: ArrayLike) -> FloatArray:
        """Position P(u) in m, shape (..., 2)."""
        return self._raw(self.wrap(u), 0)

    def derivative(self, u: ArrayLike) -> FloatArray:
        """First derivative dP/du, shape (..., 2)."""
        return self._raw(self.wrap(u), 1)

    def derivatives(self, u: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """``P, dP/du, d2P/du2`` at once, each of shape (..., 2)."""
        point, first, second = self.places(self.wrap(u))
        return as_vectors(point), as_vectors(first), as_vectors(second)

    def tangent(self, u: ArrayLike) -> FloatArray:
        """Return the unit vector along increasing u, shape (..., 2)."""
        return unit(self.derivative(u))

    def normal(self, u: ArrayLike) -> FloatArray:
        """Return the unit vector to the left of the tangent, shape (..., 2)."""
        return left(self.tangent(u))

    def curvature(self, u: ArrayLike) -> FloatArray:
        """Signed curvature in 1/m, positive to the left, shape (...)."""
        _, first, second = self.derivatives(u)
        return np.asarray(cross(first, second) / np.linalg.norm(first, axis=-1) ** 3)

    def locate(self, u: float) -> tuple[int, float]:
        """Index of the piece at u, and that piece's own parameter there."""
        wrapped = float(self.wrap(u))
        index = int(self._indices(wrapped))
        return index, self.pieces[index].start + (wrapped - float(self.breaks[index]))

    def _indices(self, u: ArrayLike) -> IndexArray:
        pieces = np.searchsorted(self.breaks, u, side="right") - 1
        return np.asarray(np.minimum(np.maximum(pieces, 0), len(self.pieces) - 1))

    # --- the curve as a whole ---------------------------------------------------------------

    @cached_property
    def samples(self) -> tuple[FloatArray, FloatArray]:
        """The :meth:`grid` u (n,) and the points there (n, 2)."""
        u = self.grid()
        return u, self._raw(u, 0)

    @property
    def size(self) -> float:
        """Larger side in m of the box around the sampled curve."""
        return float(np.max(np.ptp(self.samples[1], axis=0)))

    def length(self) -> float:
        """Length in m, by 12-point Gauss quadrature over every step of the grid."""
        return self.arc_length.whole

    def nearest(self, point: FloatArray, near: float | None = None) -> float:
        """Parameter of the foot point of ``point`` (2,).

        Without ``near`` it is the closest point of the whole curve, within the parameter range.
        With ``near`` it is the local minimum that is reached from there while the distance falls.
        So it stays on its branch where the curve crosses itself, and goes beyond the range over the
        laps of a closed curve.
        """
        if near is not None:
            return descend(self, point, near)
        return float(candidates(self, point)[0])

    def closest(self, points: FloatArray) -> FloatArray:
        """Parameters (...), within the range, of the places closest to points (..., 2)."""
        return closest(self, points)

    @cached_property
    def arc_length(self) -> ArcLength:
        """Lengths along the curve."""
        return ArcLength(self)

    @property
    def knots(self) -> Knots:
        """Places between the breaks where the third derivative jumps; lower ones never do."""
        piece_knots = [piece.knots for piece in self.pieces if piece is not self]
        if not piece_knots:
            return Knots(np.empty(0), np.empty((0, 2)))
        shifts = self.breaks[:-1] - [piece.start for piece in self.pieces]
        places = [of.places + shift for of, shift in zip(piece_knots, shifts, strict=True)]
        return Knots(np.concatenate(places), np.concatenate([of.jumps for of in piece_knots]))

    def part(self, first: float, last: float) -> Curve:
        """Cut the stretch ``first <= u <= last`` out of a smooth piece, as a new piece."""
        raise NotImplementedError

    def crossings(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """The piece's parameters where it crosses the line along the unit vector `direction`.

        The search is between samples, and a little beyond the ends of an open piece. A piece with a
        formula uses that instead.
        """
        slack = 0.0 if self.closed else OVERLAP * self.period
        begin, end = self.start - slack, self.end + slack
        u = np.concatenate([[begin], self.grid()[1:-1], [end]])

        def beside(places: FloatArray) -> FloatArray:
            place, _, _ = self.places(places)
            return cross(direction, as_vectors(place) - origin)

        sides = beside(u) > 0
        changes = np.flatnonzero(sides[1:] != sides[:-1])
        side = sides[changes]
        low, high = u[changes], u[changes + 1]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            is_left = beside(middle) > 0
            before = is_left == side
            low = np.where(before, middle, low)
            high = np.where(before, high, middle)
        return np.asarray(0.5 * (low + high))


@dataclass(frozen=True)
class Composite(Curve):
    """A curve of several pieces; the ranges of their own parameters follow one another."""

    def _lay(self, pieces: tuple[Curve, ...], start: float, closed: bool) -> None:
        ends = start + np.cumsum([piece.period for piece in pieces])
        self._fill(closed, pieces, np.concatenate([[start], ends]))

    def places(self, u: FloatArray) -> Places:
        """Evaluate at each u the piece to which it belongs."""
        index, columns = self._indices(u), np.empty((3, *np.shape(u)), dtype=np.complex128)
        for number in np.unique(index):
            rows, piece = index == number, self.pieces[number]
            columns[:, rows] = piece.places(piece.start + (u[rows] - self.breaks[number]))
        return columns[0], columns[1], columns[2]

    def grid(self) -> FloatArray:
        """Grids of all pieces, one after another."""
        parts = [
            start + (piece.grid()[:-1] - piece.start)
            for piece, start in zip(self.pieces, self.breaks[:-1], strict=True)
        ]
        return np.concatenate([*parts, self.breaks[-1:]])


class ArcLength:
    """Lengths (m) along a curve as functions of u, by Gauss quadrature from the previous sample."""

    def __init__(self, curve: Curve) -> None:
        self._curve, self._u = curve, curve.samples[0]
        parts = self._between(self._u[:-1], self._u[1:])
        self._lengths = np.concatenate([[0.0], np.cumsum(parts)])
        self.whole = float(self._lengths[-1])

    def to(self, u: FloatArray) -> FloatArray:
        """Lengths from the start to places (...); beyond an end the last piece continues."""
        i = np.clip(np.searchsorted(self._u, u, side="right") - 1, 0, len(self._u) - 2)
        return np.asarray(self._lengths[i] + self._between(self._u[i], u))

    def place(self, length: FloatArray) -> FloatArray:
        """Places (...) at lengths from the start, interpolated between the curve's samples."""
        return np.interp(length, self._lengths, self._u)

    def _between(self, low: FloatArray, high: FloatArray) -> FloatArray:
        half = 0.5 * (high - low)
        inside = low[..., None] + half[..., None] * (1 + NODES)
        return np.asarray(half * (np.linalg.norm(self._curve._raw(inside, 1), axis=-1) @ WEIGHTS))


def ray_crossings(curve: Curve, origin: FloatArray, direction: FloatArray) -> FloatArray:
    """All u, ascending over one period, where the line through ``origin`` crosses the curve.

    The line runs both ways from ``origin`` (2,) along ``direction`` (2,), a vector of any length.
    Points where it only touches count, too; a straight piece that lies in the line contributes its
    two ends. A crossing next to a break may occur twice, the second time as the break itself, at
    most 1e-7 of a piece away. Closed form for arcs and lines, roots of the cubics for splines.
    """
    places = []
    for piece, begin in zip(curve.pieces, curve.breaks[:-1], strict=True):
        u = piece.crossings(origin, unit(direction)) - piece.start
        # On a closed piece, crossings just outside the range belong to its other end.
        u = np.mod(u, piece.period) if piece.closed else np.clip(u, 0.0, piece.period)
        places.append(begin + u)
    return np.sort(np.concatenate(places))


def as_vectors(places: ComplexArray) -> FloatArray:
    """Complex numbers (...) as vectors (..., 2)."""
    return np.stack([np.real(places), np.imag(places)], axis=-1)


def unit(vector: FloatArray) -> FloatArray:
    """``vector`` (..., 2) scaled to length 1."""
    return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True))


def left(vector: FloatArray) -> FloatArray:
    """``vector`` (..., 2) turned by +90 degrees."""
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Component along z of a x b, for (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def angle_between(a: FloatArray, b: FloatArray) -> float:
    """Angle in rad, 0 to pi, between two vectors (2,)."""
    return float(abs(np.arctan2(cross(a, b), a @ b)))
