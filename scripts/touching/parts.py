"""Carts, cams, faces and flown points whose gap is known in closed form at every instant.

Between strikes coordinates (k,), m or rad, move on their own: evenly, or on a spring. A gap (m) is
a function of them that is zero at a touch; it is looked at so densely that no dip is short, and its
lows are looked for exactly. Times in s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np
from drawing.parts import spread, within
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.optimize import brentq, minimize_scalar

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from touching.drawn import Drawn, GrazeError, Rng, drawn, just_off, pair, returned, turned

LOOKS = 200_000  # between strikes
A_SPAN = 500  # looks at a spline between two of its points
MOST = 12  # strikes
CLOSEST = 1e-15  # s: of the instant of a touch


class Gap(Protocol):
    """A gap (n,) of coordinates (k, n), and how it changes with each of (k,) of them."""

    def __call__(self, q: FloatArray) -> FloatArray: ...

    def slope(self, q: FloatArray) -> FloatArray: ...


def evenly(q: FloatArray, v: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates and speeds (k, n) at instants (n,) after those (k,) at 0, without a force."""
    return q[:, None] + v[:, None] * t, np.broadcast_to(v[:, None], (len(v), len(t)))


@dataclass(frozen=True)
class Moved:
    """Motions from one strike to the next: instants (pieces,), coordinates and speeds (k,)."""

    fly: Callable = evenly
    begins: list[float] = field(default_factory=list)
    pieces: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)

    def __call__(self, time: FloatArray) -> FloatArray:
        """Coordinates (k, n) at instants (n,)."""
        found = np.empty((len(self.pieces[0][0]), len(time)))
        number = np.searchsorted(self.begins, time, side="right") - 1
        for k, (begin, piece) in enumerate(zip(self.begins, self.pieces, strict=True)):
            found[:, number == k] = self.fly(*piece, time[number == k] - begin)[0]
        return found


def moved(
    gap: Gap,
    masses: FloatArray,
    start: tuple[FloatArray, FloatArray],
    end: float,
    restitution: float,
    near: float,
    fly: Callable = evenly,
) -> Moved:
    """Move coordinates (k,) with speeds (k,) to an end; strikes give back some of the gap's rate.

    Raises:
        GrazeError: it begins nearer than `near` (m), or passes as near; or strikes too often.

    """
    run = Moved(fly, [0.0], [start])
    if gap(start[0][:, None])[0] < near:
        raise GrazeError
    for _ in range(MOST):
        piece, begin = run.pieces[-1], run.begins[-1]

        def away(t: FloatArray, piece: tuple[FloatArray, FloatArray] = piece) -> FloatArray:
            return gap(fly(*piece, np.atleast_1d(t))[0])

        t = first_fall(away, end - begin, near, left=len(run.pieces) > 1)
        if t is None:
            return run
        q, v = (own[:, 0] for own in fly(*piece, np.array([t])))
        slope = gap.slope(q)
        pushed = slope / masses
        v = v - (1 + restitution) * (slope @ v) / (slope @ pushed) * pushed
        run.begins.append(begin + t)
        run.pieces.append((q, v))
    raise GrazeError


def first_fall(
    gap: Callable[[FloatArray], FloatArray], end: float, near: float, *, left: bool
) -> float | None:
    """Find when a gap of an instant first falls to zero before an end; at 0 it may just be `left`.

    Raises:
        GrazeError: at a low before, or at the next one after, it is nearer to zero than `near`.

    """
    times = np.linspace(0, end, LOOKS)
    values = gap(times)
    if left:
        values[0] = abs(values[0])
    below = np.append(np.flatnonzero(values < 0), LOOKS)[0]
    bend = values[:-2] - 2 * values[1:-1] + values[2:]
    lows = 1 + np.flatnonzero((np.diff(values[:-1]) <= 0) & (np.diff(values[1:]) >= 0))
    lows = lows[np.abs(values[lows]) < near + bend[lows - 1]]
    for k in lows[lows <= _turn(values, below)]:
        around = float(times[k - 1]), float(times[k + 1])
        low = minimize_scalar(lambda t: gap(t)[0], bounds=around, options={"xatol": 1e-12 * end})
        if abs(low.fun) < near or (low.fun < 0 and k < below):
            raise GrazeError
    if below == LOOKS:
        return None
    if below == 1:
        raise GrazeError  # it is struck again at once
    return float(brentq(lambda t: gap(t)[0], times[below - 1], times[below], xtol=CLOSEST))


def _turn(values: FloatArray, begin: int) -> int:
    """Where values that fall from `begin` on first rise again."""
    rising = np.flatnonzero(np.diff(values[begin:]) > 0)
    return begin + int(rising[0]) + 1 if len(rising) else len(values)


# --- gaps -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Profile:
    """The curve on which the middle of a roller is as it touches a spline: height by place.

    Of a hill y by x; of a closed cam the distance to its middle by the angle around it.
    """

    height: CubicHermiteSpline
    rate: CubicHermiteSpline
    top: float

    @classmethod
    def of(cls, points: ComplexArray, radius: float, *, closed: bool) -> Profile:
        """Of a spline through points (n,); the roller is on its left, or outside.

        Raises:
            GrazeError: that curve goes back.

        """
        through = np.append(points, points[:1]) if closed else points
        chords = np.append(0, np.cumsum(np.abs(np.diff(through))))
        spline = CubicSpline(chords, through, bc_type="periodic" if closed else "not-a-knot")
        spans = [np.linspace(a, b, A_SPAN, endpoint=False) for a, b in pairwise(chords)]
        u = np.append(np.concatenate(spans), chords[-1])
        ahead = spline(u, 1) / abs(spline(u, 1))
        at = spline(u) + (-1j if closed else 1j) * radius * ahead
        if closed:
            along, height = np.unwrap(np.angle(at)), np.abs(at)
            ahead = ahead / np.exp(1j * along)
            slope = height * ahead.real / ahead.imag
        else:
            along, height, slope = at.real, at.imag, ahead.imag / ahead.real
        if np.diff(along).min() <= 0:
            raise GrazeError
        curve = CubicHermiteSpline(
            along, height, slope, extrapolate="periodic" if closed else False
        )
        return cls(curve, curve.derivative(), height.max())


@dataclass(frozen=True)
class Over:
    """A roller at x, y over a hill; or at x, on a slide at a height."""

    hill: Profile
    slide: float = 0.0

    def __call__(self, q: FloatArray) -> FloatArray:
        """How much higher it is."""
        return (q[1] if len(q) > 1 else self.slide) - self.hill.height(q[0])

    def slope(self, q: FloatArray) -> FloatArray:
        """By x, y."""
        return np.array([-self.hill.rate(q[0]), 1.0])[: len(q)]


@dataclass(frozen=True)
class Apart:
    """Two circles whose middles are apart by complex lengths along each coordinate."""

    start: complex
    along: ComplexArray
    far: float

    def __call__(self, q: FloatArray) -> FloatArray:
        """Distance of the middles beyond the sum of both radii."""
        return np.abs(self.start + self.along @ q) - self.far

    def slope(self, q: FloatArray) -> FloatArray:
        """By each coordinate."""
        away = self.start + self.along @ q
        return (self.along * np.conj(away) / abs(away)).real


@dataclass(frozen=True)
class Around:
    """A roller at x, y, or at x, beside a cam that has turned by an angle: (angle, x, y)."""

    cam: Profile

    def __call__(self, q: FloatArray) -> FloatArray:
        """How much farther out it is than where it touches at its angle."""
        place = self.place(q)
        return np.abs(place) - self.cam.height(np.angle(place) - q[0])

    def slope(self, q: FloatArray) -> FloatArray:
        """By the cam's angle, x, y."""
        place = self.place(q)
        rate = self.cam.rate(np.angle(place) - q[0])
        away = place / abs(place) * (1 - 1j * rate / abs(place))
        return np.array([rate, away.real, away.imag])[: len(q)]

    @staticmethod
    def place(q: FloatArray) -> ComplexArray:
        """Complex places of the roller."""
        return q[1] + 1j * q[2] if len(q) > 2 else q[1] + 0j


@dataclass(frozen=True)
class Above:
    """A flat face at a height over an ellipse of two axes that has turned: (angle, height)."""

    axes: tuple[float, float]

    def __call__(self, q: FloatArray) -> FloatArray:
        """How much higher it is than the ellipse reaches."""
        a, b = self.axes
        return q[1] - np.hypot(a * np.sin(q[0]), b * np.cos(q[0]))

    def slope(self, q: FloatArray) -> FloatArray:
        """By the angle and the height."""
        a, b = self.axes
        reach = np.hypot(a * np.sin(q[0]), b * np.cos(q[0]))
        return np.array([(b * b - a * a) * np.sin(q[0]) * np.cos(q[0]) / reach, 1.0])


# --- what is drawn --------------------------------------------------------------------------------

LAW = "law: {type: impulse, restitution: $restitution}"
CURVE = "type: point_on_curve, point: ball.c, radius: $radius, curve: curve"
CIRCLES = "type: circle_on_circle, circles: [{at: ball.c, radius: $radius}, {$other}]"
FLOWN = f"""
bodies: {{ball: {{type: rigid, mass: 1, inertia: 0, points: {{c: [0, 0]}}}}}}
curves: {{curve: $curve}}
contacts: {{hit: {{{CURVE}, side: left, {LAW}}}}}
initial: {{positions: {{ball: $place}}, velocities: {{ball: $speed}}}}
"""
CART = f"""
bodies:
  ball: {{type: rigid, mass: $mass, inertia: 1, points: {{c: [0, 0]}}}}
$more
contacts: {{hit: {{$pair, {LAW}}}}}
"""
SLIDE = "  {way}: {{type: prismatic, points: [ground, {body}.c], at: {at}, axis: {axis}}}\n"
CAM = f"""
bodies:
  cam: {{type: rigid, mass: 1, inertia: $inertia, points: {{hub: [0, 0]}}}}
  ball: {{type: rigid, mass: $mass, inertia: 1, points: {{c: [0, 0], a: [-1, 0], b: [1, 0]}}}}
joints:
  shaft: {{type: revolute, points: [ground, cam.hub], at: [0, 0]}}
  $guide
curves: {{curve: $curve}}
contacts: {{hit: {{$pair, {LAW}}}}}
initial: {{speeds: {{cam: $speed}}, angles: {{cam: $angle}}, $start}}
"""


def hill_of(rng: Rng) -> tuple[ComplexArray, float]:
    """Points (n,) of a narrow hill on a floor from -3 m to 3 m, and the radius of a roller."""
    width = spread(rng, 0.005, 0.3)
    beside = np.append(3 * width * 2.0 ** np.arange(1, np.log2(0.9 / width)), 3.0)
    x = np.concatenate([-beside[::-1], width * np.linspace(-3, 3, 13), beside])
    radius = float(rng.choice([0.0, width * spread(rng, 0.01, 0.5)]))
    return x + 1j * width * spread(rng, 0.3, 2) * np.exp(-((x / width) ** 2)), radius


def hill(rng: Rng) -> Drawn:
    """A point, or a roller, flies level or at a shallow angle into a hill, or just over it."""
    points, radius = hill_of(rng)
    profile = Profile.of(points, radius, closed=False)
    high = radius + (profile.top - radius) * just_off(rng)
    level = rng.random() < 0.5
    speed = spread(rng, 0.5, 20) * turned(0.0 if level else rng.choice([-1, 1]) * spread(rng, 1e-3, 0.2))
    end = spread(rng, 0.1, 1) / abs(speed)
    place = 1j * high - end * speed
    end *= within(rng, 1.2, 2)
    if rng.random() < 0.5:  # to the left
        place, speed = -place.conjugate(), -speed.conjugate()
    restitution, tolerance = returned(rng), spread(rng, 1e-8, 1e-5)
    start = np.array(pair(place)), np.array(pair(speed))
    run = moved(Over(profile), np.ones(2), start, end, restitution, tolerance)
    names = {"curve": spline(points, closed=False), "place": pair(place), "speed": pair(speed)}
    names |= {"radius": radius, "restitution": restitution, "end": end, "tolerance": tolerance}
    return drawn(FLOWN, "ball.c", lambda t: (1, 1j) @ run(t), title="hill", **names)


def spline(points: ComplexArray, *, closed: bool, on: str = "") -> str:
    """Write a spline through points (n,), on a body if one is named."""
    at = [pair(point) for point in points]
    return f"{{type: spline, closed: {str(closed).lower()}, points: {at}{on and f', on: {on}'}}}"
