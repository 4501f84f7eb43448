"""Smooth pieces in closed form: arcs of ellipses and circles, line segments."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves.base import (
    OVERLAP,
    ROUNDING,
    Curve,
    CurveError,
    Places,
    as_point,
    cross,
)

TURN = 2 * math.pi
STEPS_PER_TURN = 128


@dataclass(frozen=True)
class Arc(Curve):
    """Arc of an ellipse between two eccentric angles (rad); clockwise if ``end_angle`` is smaller.

    ``semi_axes`` (a, b) in m, a turned by ``rotation`` (rad) from x:
    ``P = centre + R(rotation) (a cos u, b sin u)``. Default: the full ellipse, closed. The
    parameter u is the angle, or minus the angle of a clockwise arc: it always increases.

    Raises:
        CurveError: an axis not positive, equal angles, more than a turn, something not finite.

    """

    centre: tuple[float, float]
    semi_axes: tuple[float, float]
    rotation: float = 0.0
    start_angle: float = 0.0
    end_angle: float = TURN
    conic: tuple[FloatArray, FloatArray, FloatArray] = field(init=False, repr=False, compare=False)
    """C, A and B (m) of ``P = C + A cos u + B sin u``, however the arc runs."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", as_point(self.centre, "centre"))
        object.__setattr__(self, "semi_axes", as_point(self.semi_axes, "semi-axes"))
        if min(self.semi_axes) <= 0:
            raise CurveError(f"semi-axes must be positive, got {self.semi_axes}")
        if not math.isfinite(self.rotation):
            raise CurveError(f"rotation must be finite, got {self.rotation}")
        sweep = self.end_angle - self.start_angle
        if not math.isfinite(sweep) or sweep == 0:
            ends = f"{self.start_angle} to {self.end_angle}"
            raise CurveError(f"an arc needs two different angles, got {ends}")
        if abs(sweep) > TURN + ROUNDING:
            raise CurveError(
                f"an arc of {math.degrees(abs(sweep)):.9g} degrees is more than one turn",
                hint="a full turn is a closed curve already, and repeats",
            )
        c, s = math.cos(self.rotation), math.sin(self.rotation)
        (a, b), turned = self.semi_axes, math.copysign(1.0, sweep)
        arms = a * np.array([c, s]), turned * b * np.array([-s, c])
        object.__setattr__(self, "conic", (np.array(self.centre), *arms))
        full = abs(abs(sweep) - TURN) <= ROUNDING
        first = turned * self.start_angle
        self._range(first, first + TURN if full else turned * self.end_angle, full)

    def places(self, u: FloatArray) -> Places:
        """Evaluate the whole ellipse."""
        centre, a, b = (complex(*vector.tolist()) for vector in self.conic)
        c, s = np.cos(u), np.sin(u)
        arm = a * c + b * s
        return centre + arm, b * c - a * s, -arm

    def grid(self) -> FloatArray:
        """Equal steps of at most 2 pi/128."""
        steps = math.ceil(self.period / TURN * STEPS_PER_TURN - ROUNDING)
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
        # counted from just before the start, so that a crossing there is not found a turn later
        ahead = np.mod(np.array([middle - half, middle + half]) - self.start + slack, TURN)
        return np.asarray(self.start + ahead[ahead <= self.period + 2 * slack] - slack)

    def part(self, first: float, last: float) -> Arc:
        """Cut out the arc ``first <= u <= last`` of the same ellipse."""
        turned = math.copysign(1.0, self.end_angle - self.start_angle)
        return replace(self, start_angle=turned * first, end_angle=turned * last)


def circle_arc(
    centre: tuple[float, float], radius: float, start_angle: float = 0.0, end_angle: float = TURN
) -> Arc:
    """Return an arc of a circle of a radius (m) between two polar angles (rad), as `Arc` has it."""
    return Arc(centre, (radius, radius), 0.0, start_angle, end_angle)


@dataclass(frozen=True)
class LineSegment(Curve):
    """Straight from ``a`` to ``b``; the parameter is the length along it, in m.

    Raises:
        CurveError: the ends coincide, or are not finite.

    """

    a: tuple[float, float]
    b: tuple[float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "a", as_point(self.a, "line start"))
        object.__setattr__(self, "b", as_point(self.b, "line end"))
        length = math.dist(self.a, self.b)
        if length == 0:
            raise CurveError(f"a line needs two different ends, got {self.a} twice")
        self._range(0.0, length, closed=False)

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
        ends = self.point([first, last])
        return LineSegment(as_point(ends[0], "line start"), as_point(ends[1], "line end"))

    def crossings(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """One place, none if parallel, both ends if the segment lies in the line."""
        offset = float(cross(direction, origin - np.array(self.a)))
        slant = float(cross(direction, self.derivative(0.0)))
        if abs(slant) <= 1e-14:
            inside = abs(offset) <= ROUNDING * self.end
            return np.array([self.start, self.end]) if inside else np.empty(0)
        u, slack = offset / slant, OVERLAP * self.period
        return np.array([u]) if -slack <= u <= self.end + slack else np.empty(0)
