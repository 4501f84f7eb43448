"""Cubic splines through points."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves.base import (
    OVERLAP,
    ROUNDING,
    Curve,
    CurveError,
    Knots,
    Places,
    left,
)

FEWEST_POINTS, MOST_POINTS = 4, 20_000
STEPS_PER_SPAN = 4
# With chord length as parameter |dP/du| is about 1; this much less is a cusp.
SLOWEST = 1e-3
# Of the mean of the chords beside it: a chord this short is none. The curve passes along it, and an
# error across it turns the curve: nearby it is off by 0.2 / SHORT times that (measured on circles).
SHORT = 1e-2
LIKE = 1.5  # times as long, or as short: so far a chord is like those beside it


@dataclass(frozen=True, eq=False)
class SplinePiece(Curve):
    """The stretch ``first <= u <= last`` of a spline; ``u`` in m as on the whole spline.

    A closed spline may be cut open anywhere: then ``last`` goes up to ``first`` + its period.
    """

    spline: Spline
    first: float
    last: float

    def __post_init__(self) -> None:
        whole = abs(self.last - self.first - self.spline.period) <= ROUNDING * self.spline.period
        last = self.first + self.spline.period if whole else self.last
        self._range(self.first, last, self.spline.closed and whole)

    def places(self, u: FloatArray) -> Places:
        """Evaluate the whole spline."""
        return self.spline.places(u)

    def grid(self) -> FloatArray:
        """Take the spline's grid within the stretch."""
        base = self.spline.grid()
        laps = [base, base[1:] + self.spline.period] if self.spline.closed else [base]
        every = np.concatenate(laps)
        # a grid value a hair inside the ends would make an empty step
        slack = ROUNDING * self.period
        inside = (every > self.start + slack) & (every < self.end - slack)
        return np.concatenate([[self.start], every[inside], [self.end]])

    @property
    def knots(self) -> Knots:
        """Those of the spline that lie inside the stretch."""
        return self.spline.knots_between(self.start, self.end)

    def part(self, first: float, last: float) -> SplinePiece:
        """Cut out the stretch ``first <= u <= last``."""
        return SplinePiece(self.spline, first, last)

    def crossings(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """Those of the spline that lie on the stretch."""
        found = self.spline.crossings(origin, direction)
        slack = OVERLAP * self.period
        if self.spline.closed:
            ahead = np.mod(found - self.start + slack, self.spline.period)
            found = self.start + ahead - slack
        return np.asarray(found[(found >= self.start - slack) & (found <= self.end + slack)])


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
        """Evaluate the cubics; an open spline goes on with its last ones."""
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
        """The given points but for the ends: there one cubic follows another."""
        return self.knots_between(self.start, self.end)

    def knots_between(self, first: float, last: float) -> Knots:
        """Knots in ``first < u < last``, also of the next lap of a closed spline."""
        places, cubes = self._polynomial.x, 6 * self._polynomial.c[0]
        jumps = np.diff(cubes, axis=0)
        if self.closed:  # where the spline ends its next lap begins
            jumps = np.concatenate([jumps, cubes[:1] - cubes[-1:]])
            jumps = np.concatenate([jumps, jumps])
            places = np.concatenate([places[1:], places[1:] + self.period])
        else:
            places = places[1:-1]
        slack = ROUNDING * (last - first)
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
        # the end spans are continued, lest rounding push a root at an end beyond it
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
    """Return the points of a spline (N, 2), m, and whether it is closed; None: where it looks so.

    A last point that nearly repeats the first closes it, and is left out.

    Raises:
        CurveError: it looks neither closed nor nearly closed, and `closed` is None; or these are
            too few or too many points.

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
    """Lengths (n,) of chords, and of those before and after each (2, n), m; one at an end twice."""
    chords = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    chords = chords if closed else chords[:-1]
    beside = np.array([np.roll(chords, 1), np.roll(chords, -1)])
    if not closed:
        beside[:, [0, -1]] = beside[[[1], [0]], [0, -1]]
    return chords, beside
