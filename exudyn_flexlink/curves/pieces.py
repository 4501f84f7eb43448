"""Smooth pieces in closed form: arcs of ellipses and circles, line segments."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves.base import OVERLAP, ROUNDING, Curve, Places, cross

TURN = 2 * math.pi
STEPS_PER_TURN = 128


@dataclass(frozen=True)
class Arc(Curve):
    """Arc of an ellipse between two eccentric angles (rad), counter-clockwise, of a turn at most.

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
        full = abs(self.end_angle - self.start_angle - TURN) <= ROUNDING
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
        return replace(self, start_angle=first, end_angle=last)


def circle_arc(
    centre: tuple[float, float], radius: float, start_angle: float = 0.0, end_angle: float = TURN
) -> Arc:
    """Return an arc of a circle of a radius (m) between two polar angles (rad), as `Arc` has it."""
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
        """One place, none if parallel, both ends if the segment lies in the line."""
        offset = float(cross(direction, origin - np.array(self.a)))
        slant = float(cross(direction, self.derivative(0.0)))
        if abs(slant) <= 1e-14:
            inside = abs(offset) <= ROUNDING * self.end
            return np.array([self.start, self.end]) if inside else np.empty(0)
        u, slack = offset / slant, OVERLAP * self.period
        return np.array([u]) if -slack <= u <= self.end + slack else np.empty(0)
