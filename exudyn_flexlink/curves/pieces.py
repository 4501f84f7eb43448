"""Curves: arcs of ellipses and circles, lines, splines, joined pieces, a curve for each lap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves.base import (
    DIRECTION_TOLERANCE,
    OVERLAP,
    POSITION_TOLERANCE,
    Composite,
    Curve,
    CurveError,
    Knots,
    Places,
    angle_between,
    candidates,
    cross,
    left,
)
from exudyn_flexlink.rounding import NEGLIGIBLE

TURN = 2 * math.pi
STEPS_PER_TURN = 128


@dataclass(frozen=True)
class Arc(Curve):
    """Arc of an ellipse between two eccentric angles (rad), counter-clockwise, at most a full turn.

    ``semi_axes`` (a, b) in m, a turned by ``rotation`` (rad) from x; the parameter is the angle:
    ``P = centre + R(rotation) (a cos u, b sin u)``. Default: the full ellipse, closed.
    """

    centre: tuple[float, float]
    semi_axes: tuple[float, float]
    rotation: float = 0.0
    start_angle: float = 0.0
    end_angle: float = TURN
    conic: tuple[FloatArray, FloatArray, FloatArray] = field(init=False, repr=False, compare=False)
    """C, A and B (m) of ``P = C + A cos u + B sin u``."""

    def __post_init__(self) -> None:
        c, s = math.cos(self.rotation), math.sin(self.rotation)
        a, b = self.semi_axes
        conic = np.array(self.centre), a * np.array([c, s]), b * np.array([-s, c])
        object.__setattr__(self, "conic", conic)
        full = abs(self.end_angle - self.start_angle - TURN) <= NEGLIGIBLE
        end = self.start_angle + TURN if full else self.end_angle
        self._range(self.start_angle, end, full)

    def places(self, u: FloatArray) -> Places:
        """Evaluate the whole ellipse."""
        centre, a, b = (complex(*vector.tolist()) for vector in self.conic)
        c, s = np.cos(u), np.sin(u)
        arm = a * c + b * s
        return centre + arm, b * c - a * s, -arm

    def grid(self) -> FloatArray:
        """Equal steps of at most 2 pi/128."""
        steps = math.ceil(self.period / TURN * STEPS_PER_TURN - NEGLIGIBLE)
        return np.linspace(self.start, self.end, max(steps, 4) + 1)

    def crossings(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """Solve ``alpha cos u + beta sin u = gamma``."""
        centre, a, b = self.conic
        alpha, beta = float(cross(direction, a)), float(cross(direction, b))
        reach = math.hypot(alpha, beta)
        ratio = float(cross(direction, origin - centre)) / reach
        if abs(ratio) > 1 + 1e-14:
            return np.empty(0)
        middle, half = math.atan2(beta, alpha), math.acos(min(max(ratio, -1.0), 1.0))
        slack = OVERLAP * self.period
        # angles count from just before the start: else a crossing there would be a turn later
        ahead = np.mod(np.array([middle - half, middle + half]) - self.start + slack, TURN)
        return np.asarray(self.start + ahead[ahead <= self.period + 2 * slack] - slack)

    def part(self, first: float, last: float) -> Arc:
        """Cut out the arc ``first <= u <= last`` of the same ellipse."""
        return replace(self, start_angle=first, end_angle=last)


@dataclass(frozen=True)
class Superellipse(Curve):
    """Lame's curve ``|x/a|^n + |y/b|^n = 1``, or an arc of it, counter-clockwise, with n above 3.

    Like `Arc`, but with a factor ``f = (|cos u|^n + |sin u|^n)^(-1/n)``: ``P = centre +
    R(rotation) f (a cos u, b sin u)``. With n up to 3 its third derivative would jump or be
    unbounded.
    """

    centre: tuple[float, float]
    semi_axes: tuple[float, float]
    exponent: float
    rotation: float = 0.0
    start_angle: float = 0.0
    end_angle: float = TURN

    def __post_init__(self) -> None:
        full = abs(self.end_angle - self.start_angle - TURN) <= NEGLIGIBLE
        end = self.start_angle + TURN if full else self.end_angle
        self._range(self.start_angle, end, full)

    def places(self, u: FloatArray) -> Places:
        """Evaluate the whole curve."""
        n = self.exponent
        c, s = np.cos(u), np.sin(u)
        turned = complex(math.cos(self.rotation), math.sin(self.rotation))
        a, b = self.semi_axes
        arm = turned * (a * c + 1j * b * s)
        ahead = turned * (1j * b * c - a * s)
        cosine = np.abs(c) ** (n - 2)
        sine = np.abs(s) ** (n - 2)
        whole = cosine * c * c + sine * s * s
        slope = c * s * (sine - cosine)  # derivative of `whole`, divided by n
        turning = (c * c - s * s) * (sine - cosine)
        bend = turning + (n - 2) * (sine * c * c + cosine * s * s)
        factor = whole ** (-1 / n)
        first = -factor * slope / whole
        second = factor * ((1 + n) * (slope / whole) ** 2 - bend / whole)
        place = complex(*self.centre) + factor * arm
        along = first * arm + factor * ahead
        bent = second * arm + 2 * first * ahead - factor * arm
        return place, along, bent

    def grid(self) -> FloatArray:
        """Steps of at most 2 pi/128, and places on the axes."""
        steps = math.ceil(self.period / TURN * STEPS_PER_TURN - NEGLIGIBLE)
        return np.linspace(self.start, self.end, max(steps, 4) + 1)

    def part(self, first: float, last: float) -> Superellipse:
        """Cut out the arc ``first <= u <= last`` of the same curve."""
        return replace(self, start_angle=first, end_angle=last)


def circle_arc(
    centre: tuple[float, float], radius: float, start_angle: float = 0.0, end_angle: float = TURN
) -> Arc:
    """Return an arc of a circle of a radius (m) between two polar angles (rad): see `Arc`."""
    return Arc(centre, (radius, radius), 0.0, start_angle, end_angle)


@dataclass(frozen=True)
class LineSegment(Curve):
    """Straight from ``a`` to ``b``; the parameter is the length along it, in m."""

    a: tuple[float, float]
    b: tuple[float, float]

    def __post_init__(self) -> None:
        self._range(0.0, math.dist(self.a, self.b), closed=False)

    def places(self, u: FloatArray) -> Places:
        """Evaluate the whole line."""
        start, end = complex(*self.a), complex(*self.b)
        along, straight = (end - start) / self.end, np.zeros_like(u, dtype=np.complex128)
        return start + along * u + straight, straight + along, straight

    def grid(self) -> FloatArray:
        """Start, three places between, end."""
        return np.linspace(self.start, self.end, 5)

    def part(self, first: float, last: float) -> LineSegment:
        """Cut out the stretch ``first <= u <= last``."""
        (x0, y0), (x1, y1) = self.point([first, last]).tolist()
        return LineSegment((x0, y0), (x1, y1))

    def crossings(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """Return one place, none if parallel, or both ends if the segment lies in the line."""
        offset = float(cross(direction, origin - np.array(self.a)))
        slant = float(cross(direction, self.derivative(0.0)))
        if abs(slant) <= 1e-14:
            inside = abs(offset) <= NEGLIGIBLE * self.end
            return np.array([self.start, self.end]) if inside else np.empty(0)
        u, slack = offset / slant, OVERLAP * self.period
        return np.array([u]) if -slack <= u <= self.end + slack else np.empty(0)


@dataclass(frozen=True)
class Joined(Composite):
    """``pieces`` in order: each starts where the previous one ends, in the same direction.

    The parameter starts as that of the first piece and grows by the ranges of the others. The curve
    is closed if its end meets its start; then the direction must be the same there, too. A joined
    curve among the pieces is replaced by its own pieces.

    Raises:
        CurveError: a gap or a kink between two pieces; ``piece`` is the index of the second.

    """

    pieces: tuple[Curve, ...]

    def __post_init__(self) -> None:
        given = tuple(self.pieces)
        closed = meet_all(given)
        for index in range(1, len(given)):
            _check_kink(given[index - 1], given[index], index, (index, index + 1))
        if closed:
            _check_kink(given[-1], given[0], 0, (len(given), 1))
        flat = tuple(smooth for piece in given for smooth in piece.pieces)
        self._lay(flat, flat[0].start, closed)


def meet_all(given: Sequence[Curve]) -> bool:
    """Tell whether the last of some pieces ends where the first one starts.

    Raises:
        CurveError: a piece does not start where the previous one ends.

    """
    size = max(piece.size for piece in given)
    for index in range(1, len(given)):
        gap = _gap(given[index - 1], given[index])
        if gap > _tolerance(size):
            end, start = _last(given[index - 1]), _first(given[index])
            raise CurveError(
                f"piece {index + 1} starts at {show(start)}, {gap:.3g} m away from the end of "
                f"piece {index} at {show(end)}",
                piece=index,
                hint="let each piece start where the one before ends",
            )
    return _gap(given[-1], given[0]) <= _tolerance(size)


@dataclass(frozen=True)
class Laps(Composite):
    """A closed curve for each lap, in turn and for ever: lap 1 is on the first, and so on.

    All curves pass the point ``meet`` (default: the start of the first curve) in the same
    direction; there the next curve takes over. The parameter is 0 at ``meet`` and grows in each lap
    by the range of that lap's curve. A ``period`` is one turn through all ``curves``. ``firsts``
    are the indices of the laps' first pieces, then the number of all pieces.

    Raises:
        CurveError: a curve is open, misses ``meet``, or passes it in another direction; ``piece``
            is the index of that curve.

    """

    curves: tuple[Curve, ...]
    meet: tuple[float, float] | None = None
    firsts: tuple[int, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        curves = tuple(self.curves)
        meet = np.array(_first(curves[0]) if self.meet is None else self.meet)
        # By default the first curve is cut at its start, even if it passes this point again.
        cut = curves[0].start if self.meet is None else None
        heading: FloatArray | None = None
        laps = []
        for index, curve in enumerate(curves):
            _check_closed(curve, index)
            cut = _cut_place(curve, index, meet, heading) if cut is None else cut
            heading = curve.tangent(cut) if heading is None else heading
            laps.append(_rotated(curve, cut))
            cut = None
        object.__setattr__(self, "curves", curves)
        self._lay(tuple(piece for lap in laps for piece in lap), 0.0, closed=True)
        object.__setattr__(self, "firsts", tuple(accumulate(map(len, laps), initial=0)))


def next_lap(lap: int, way: int) -> int:
    """Lap that a point enters over the seam, forwards (`way` 1) or backwards (-1).

    A lap of a closed curve goes once around from its seam. From the begin of lap 1, laps are 1, 2,
    .. forwards and -1, -2, .. backwards; there is no lap 0. With `Laps`, lap -k is on the same
    curve as lap k: a point takes the curves in the same order in both directions.
    """
    return lap + way or way


def next_piece(curve: Curve, piece: int, lap: int, way: int) -> tuple[int, int] | None:
    """Piece and lap after the end of a piece (`way` 1) or before its start (-1).

    None at an end of an open curve.
    """
    first, last = _pieces_of_lap(curve, lap)
    if first <= piece + way <= last:
        return piece + way, lap
    if not curve.closed:
        return None
    lap = next_lap(lap, way)
    first, last = _pieces_of_lap(curve, lap)
    return (first if way > 0 else last), lap


def ends_of_lap(curve: Curve, lap: int) -> tuple[float, float]:
    """Parameters at which a lap begins and ends; the ends of the curve if it has no laps."""
    first, last = _pieces_of_lap(curve, lap)
    return float(curve.breaks[first]), float(curve.breaks[last + 1])


def _pieces_of_lap(curve: Curve, lap: int) -> tuple[int, int]:
    """First and last piece of a lap, or of the whole curve if it has no laps."""
    if not isinstance(curve, Laps):
        return 0, len(curve.pieces) - 1
    number = (abs(lap) - 1) % len(curve.curves)
    return curve.firsts[number], curve.firsts[number + 1] - 1


def curves_of_laps(curve: Curve) -> tuple[Curve, ...]:
    """Closed curves of the laps in turn, each from the meeting point; other curves as they are."""
    if not isinstance(curve, Laps):
        return (curve,)
    return tuple(Joined(curve.pieces[first:last]) for first, last in pairwise(curve.firsts))


def _check_closed(curve: Curve, index: int) -> None:
    if not curve.closed:
        raise CurveError(
            f"curve {index + 1} of the laps is open: its ends {show(_first(curve))} and "
            f"{show(_last(curve))} are {_gap(curve, curve):.3g} m apart",
            piece=index,
            hint="a lap needs a closed curve",
        )


def _cut_place(curve: Curve, index: int, meet: FloatArray, heading: FloatArray | None) -> float:
    """Parameter at which ``curve`` passes ``meet``, along ``heading`` if it is given."""
    feet = candidates(curve, meet)
    distances = np.linalg.norm(curve.point(feet) - meet, axis=1)
    if distances[0] > _tolerance(curve.size):
        raise CurveError(
            f"curve {index + 1} of the laps passes the meeting point {show(meet)} "
            f"at a distance of {distances[0]:.3g} m",
            piece=index,
            hint="all curves must pass through the point where the laps change",
        )
    passes = feet[distances <= _tolerance(curve.size)]
    if heading is None:
        return _snapped(curve, float(passes[0]))
    turns = [angle_between(heading, curve.tangent(u)) for u in passes]
    best = int(np.argmin(turns))
    _check_turn(turns[best], index, meet)
    return _snapped(curve, float(passes[best]))


def _check_turn(angle: float, index: int, meet: FloatArray) -> None:
    if angle <= DIRECTION_TOLERANCE:
        return
    opposite = math.pi - angle <= DIRECTION_TOLERANCE
    if opposite:
        message = f"curve {index + 1} of the laps runs through {show(meet)} the other way round"
        hint = "give its pieces or points in the opposite order"
    else:
        message = (
            f"curve {index + 1} of the laps passes the meeting point {show(meet)} "
            f"at {math.degrees(angle):.4g} degrees to the first"
        )
        hint = "all curves must have the same tangent where the laps change"
    raise CurveError(message, piece=index, hint=hint)


def _snapped(curve: Curve, u: float) -> float:
    """Return the break at u if there is one, so that a cut leaves no tiny piece."""
    ways = np.abs(curve.breaks - u) * float(np.linalg.norm(curve.derivative(u)))
    closest = int(np.argmin(ways))
    return float(curve.breaks[closest]) if ways[closest] <= POSITION_TOLERANCE else u


def _rotated(curve: Curve, cut: float) -> tuple[Curve, ...]:
    """Pieces of the closed ``curve`` from ``cut`` once around; the piece at the cut is split."""
    index, local = curve.locate(cut)
    piece = curve.pieces[index]
    after, before = curve.pieces[index + 1 :], curve.pieces[:index]
    if local == piece.start:
        return (piece, *after, *before)
    if len(curve.pieces) == 1:
        return (piece.part(local, local + piece.period),)
    return (piece.part(local, piece.end), *after, *before, piece.part(piece.start, local))


def _check_kink(before: Curve, after: Curve, index: int, numbers: tuple[int, int]) -> None:
    last, first = before.pieces[-1], after.pieces[0]
    # Evaluate the piece, not the curve, which would wrap the end of a closed piece to its start.
    angle = angle_between(
        last._raw(np.asarray(last.end), 1), first._raw(np.asarray(first.start), 1)
    )
    if angle > DIRECTION_TOLERANCE:
        raise CurveError(
            f"pieces {numbers[0]} and {numbers[1]} meet at {show(_first(after))} with a kink of "
            f"{math.degrees(angle):.4g} degrees",
            piece=index,
            hint="a point on it needs a continuous tangent: 'round: 1 mm' puts arcs at all corners",
        )


def _first(curve: Curve) -> FloatArray:
    piece = curve.pieces[0]
    return piece._raw(np.asarray(piece.start), 0)


def _last(curve: Curve) -> FloatArray:
    # the end of the last piece: in a nearly closed curve it is not exactly the start
    piece = curve.pieces[-1]
    return piece._raw(np.asarray(piece.end), 0)


def _gap(before: Curve, after: Curve) -> float:
    return float(np.linalg.norm(_first(after) - _last(before)))


def _tolerance(size: float) -> float:
    return POSITION_TOLERANCE * max(1.0, size)


def show(point: FloatArray) -> str:
    """Return a point (2,), in m, as text for messages."""
    x, y = (round(float(value), 12) + 0.0 for value in point)
    return f"({x:.6g}, {y:.6g})"


FEWEST_POINTS, MOST_POINTS = 4, 20_000
STEPS_PER_SPAN = 4
# With chord length as parameter |dP/du| is about 1; below this value there is a cusp.
SLOWEST = 1e-3
# Part of the mean of the two neighbouring chords: a shorter chord is refused, or closes the curve.
# An error across a short chord turns the curve; nearby the curve is off by 0.2 / SHORT times that
# error (measured on circles).
SHORT = 1e-2
LIKE = 1.5  # greatest ratio of lengths of chords that count as alike


@dataclass(frozen=True, eq=False)
class SplinePiece(Curve):
    """The stretch ``first <= u <= last`` of a spline; ``u`` in m as on the whole spline.

    A closed spline may be cut open anywhere: then ``last`` goes up to ``first`` + its period.
    """

    spline: Spline
    first: float
    last: float

    def __post_init__(self) -> None:
        whole = abs(self.last - self.first - self.spline.period) <= NEGLIGIBLE * self.spline.period
        last = self.first + self.spline.period if whole else self.last
        self._range(self.first, last, self.spline.closed and whole)

    def places(self, u: FloatArray) -> Places:
        """Evaluate the whole spline."""
        return self.spline.places(u)

    def grid(self) -> FloatArray:
        """Take the spline's grid within the stretch."""
        base = self.spline.grid()
        laps = [base, base[1:] + self.spline.period] if self.spline.closed else [base]
        parameters = np.concatenate(laps)
        # a grid value very close to an end would make an empty step
        slack = NEGLIGIBLE * self.period
        inside = (parameters > self.start + slack) & (parameters < self.end - slack)
        return np.concatenate([[self.start], parameters[inside], [self.end]])

    @property
    def knots(self) -> Knots:
        """Knots of the spline inside the stretch."""
        return self.spline.knots_between(self.start, self.end)

    def part(self, first: float, last: float) -> SplinePiece:
        """Cut out the stretch ``first <= u <= last``."""
        return SplinePiece(self.spline, first, last)

    def crossings(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """Crossings of the spline on the stretch."""
        places = self.spline.crossings(origin, direction)
        slack = OVERLAP * self.period
        if self.spline.closed:
            ahead = np.mod(places - self.start + slack, self.spline.period)
            places = self.start + ahead - slack
        return np.asarray(places[(places >= self.start - slack) & (places <= self.end + slack)])


@dataclass(frozen=True, eq=False)
class Spline(Curve):
    """Cubic spline (continuous curvature) through ``points`` (N, 2) in m, 4 to 20,000 of them.

    The parameter is the length of the polygon through the points, in m. Open: not-a-knot ends.
    Closed: periodic, from the last point back to the first, which is not repeated.

    Raises:
        CurveError: too few or too many points, neighbours that nearly coincide, a cusp.

    """

    points: FloatArray
    closed: bool = field(default=False, kw_only=True)
    _polynomial: Any = field(init=False, repr=False)
    _complex: ComplexArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=float)
        _check(points)
        _refuse_short_chords(points, self.closed)
        points.flags.writeable = False
        object.__setattr__(self, "points", points)
        through = np.concatenate([points, points[:1]]) if self.closed else points
        chords = np.linalg.norm(np.diff(through, axis=0), axis=1)
        knots = np.concatenate([[0.0], np.cumsum(chords)])
        cubic = _fit(knots, through, self.closed)
        object.__setattr__(self, "_polynomial", cubic)
        object.__setattr__(self, "_complex", cubic.c[..., 0] + 1j * cubic.c[..., 1])
        self._range(0.0, float(knots[-1]), self.closed)
        self._refuse_cusps()

    def _refuse_cusps(self) -> None:
        u = self.grid()
        speeds = np.linalg.norm(self._raw(u, 1), axis=1)
        slowest = int(np.argmin(speeds))
        if speeds[slowest] < SLOWEST:
            x, y = self._raw(u[slowest], 0)
            raise CurveError(
                f"the spline has a cusp near ({x:.6g}, {y:.6g})",
                hint="place the points there closer together, or take out a stray one",
            )

    def places(self, u: FloatArray) -> Places:
        """Evaluate the cubics; an open spline continues with its outermost ones."""
        u = np.mod(u, self.period) if self.closed else u
        knots = self._polynomial.x
        index = np.clip(np.searchsorted(knots, u, side="right") - 1, 0, len(knots) - 2)
        w, (c3, c2, c1, c0) = u - knots[index], self._complex[:, index]
        first = (3 * c3 * w + 2 * c2) * w + c1
        return ((c3 * w + c2) * w + c1) * w + c0, first, 6 * c3 * w + 2 * c2

    def cubics(self) -> tuple[list[float], list[list[list[float]]]]:
        """Knots, and for every span the coefficients [x, y] of w^3, w^2, w, 1 (w from its knot)."""
        coefficients = np.moveaxis(self._polynomial.c, 0, 1)
        return self._polynomial.x.tolist(), coefficients.tolist()

    def grid(self) -> FloatArray:
        """Four steps between neighbouring points."""
        knots = self._polynomial.x
        steps = np.arange(STEPS_PER_SPAN) / STEPS_PER_SPAN
        inner = knots[:-1, None] + np.diff(knots)[:, None] * steps
        return np.append(inner.ravel(), knots[-1])

    @property
    def knots(self) -> Knots:
        """The given points without the ends: at each the cubic changes."""
        return self.knots_between(self.start, self.end)

    def knots_between(self, first: float, last: float) -> Knots:
        """Knots in ``first < u < last``, also of the next lap of a closed spline."""
        places, cubes = self._polynomial.x, 6 * self._polynomial.c[0]
        jumps = np.diff(cubes, axis=0)
        if self.closed:  # its next lap begins where the spline ends
            jumps = np.concatenate([jumps, cubes[:1] - cubes[-1:]])
            jumps = np.concatenate([jumps, jumps])
            places = np.concatenate([places[1:], places[1:] + self.period])
        else:
            places = places[1:-1]
        slack = NEGLIGIBLE * (last - first)
        inside = (places > first + slack) & (places < last - slack)
        return Knots(places[inside], jumps[inside])

    def part(self, first: float, last: float) -> SplinePiece:
        """Cut out the stretch ``first <= u <= last``."""
        return SplinePiece(self, first, last)

    def crossings(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """Roots of the cubics ``normal . (P - origin)``, span by span."""
        from scipy.interpolate import PPoly  # noqa: PLC0415 - see _fit

        normal = left(direction)
        across = PPoly(self._polynomial.c @ normal, self._polynomial.x)
        # the end spans are extended, since rounding may move a root at an end beyond it
        roots = np.asarray(across.solve(float(normal @ origin), False, True), dtype=float)
        slack = OVERLAP * self.period
        inside = np.isfinite(roots) & (roots >= -slack) & (roots <= self.end + slack)
        return np.asarray(np.clip(roots[inside], 0.0, self.end))


def _fit(knots: FloatArray, points: FloatArray, closed: bool) -> Any:
    # scipy takes a second to import, which a model without splines should not wait for
    from scipy.interpolate import CubicSpline  # noqa: PLC0415

    return CubicSpline(knots, points, bc_type="periodic" if closed else "not-a-knot")


def _check(points: FloatArray) -> None:
    if not FEWEST_POINTS <= len(points) <= MOST_POINTS:
        raise CurveError(
            f"a spline needs {FEWEST_POINTS} to {MOST_POINTS} points, got {len(points)}"
        )


def _refuse_short_chords(points: FloatArray, closed: bool) -> None:
    chords, beside = _chords(points, closed)
    short = np.flatnonzero(chords <= SHORT * beside.mean(axis=0)).tolist()
    if short:
        last = len(points) - 1
        other = "first point" if short[0] == last else "point before"
        raise CurveError(
            f"{chords[short[0]]:.3g} m from the {other}, a small part of the chords beside that",
            min(short[0] + 1, last),
            "the curve turns there by errors of digits: leave one of the two points out",
        )


def closing(points: FloatArray, closed: bool | None) -> tuple[FloatArray, bool]:
    """Return the points of a spline (N, 2), m, and whether it is closed; None: as the points look.

    If the last point nearly repeats the first, it closes the spline and is left out.

    Raises:
        CurveError: `closed` is None, and the points don't tell whether the spline is closed; or
            there are too few or too many points.

    """
    _check(points)
    if closed is False:
        return points, False
    chords, beside = _chords(points, True)
    gap, (before, after) = chords[-1], beside[:, -1]
    if gap <= SHORT * (before + after) / 2:
        return points[:-1], True
    if closed is None and not min(before, after) / LIKE <= gap <= max(before, after) * LIKE:
        raise CurveError(
            f"{gap:.3g} m from the first point, while chords beside are {before:.3g} and "
            f"{after:.3g} m: is the last point joined to the first?",
            len(points) - 1,
            "write 'closed: true' or 'closed: false'",
        )
    return points, True


def _chords(points: FloatArray, closed: bool) -> tuple[FloatArray, FloatArray]:
    """Lengths (n,), m, of chords, and of their neighbours (2, n): twice the same at an end."""
    chords = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    chords = chords if closed else chords[:-1]
    beside = np.array([np.roll(chords, 1), np.roll(chords, -1)])
    if not closed:
        beside[:, [0, -1]] = beside[[[1], [0]], [0, -1]]
    return chords, beside
