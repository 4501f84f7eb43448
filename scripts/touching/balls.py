"""A ball that flies between strikes of lines and of circles, in sixty digits.

Without gravity, or on parabolas: the gap to a line is of degree 2 in time, the square of the
distance to a circle's middle of degree 4. Lengths in m, times in s.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal, getcontext

import numpy as np
from drawing.parts import spread, within

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from touching.drawn import Drawn, GrazeError, Rng, drawn, just_off, pair, returned, turned

getcontext().prec = 60
HALVINGS = 220  # of an interval of time: to the last of sixty digits
MOST = 12  # strikes that take energy: with more of them the ball is about to come to rest

Vector = np.ndarray  # (2,) of Decimal


@dataclass(frozen=True)
class Wall:
    """Where the ball's middle is when it touches a line: `normal` . place = `offset`."""

    normal: Vector
    offset: Decimal

    def gap(self, place: Vector) -> Decimal:
        """How far the ball is off."""
        return self.normal @ place - self.offset

    def polynomial(self, place: Vector, speed: Vector, half: Vector) -> list[Decimal]:
        """Coefficients, in time, of what is zero at a touch; `half` of the acceleration."""
        return [self.gap(place), self.normal @ speed, self.normal @ half]

    def facing(self, _: Vector) -> Vector:
        """Unit normal at a touch."""
        return self.normal


@dataclass(frozen=True)
class Pin:
    """A fixed circle; `far` is the sum of both radii."""

    middle: Vector
    far: Decimal

    def gap(self, place: Vector) -> Decimal:
        """How far the ball is off."""
        away = place - self.middle
        return (away @ away).sqrt() - self.far

    def polynomial(self, place: Vector, speed: Vector, half: Vector) -> list[Decimal]:
        """Coefficients, in time, of what is zero at a touch; `half` of the acceleration."""
        away = place - self.middle
        return [
            away @ away - self.far * self.far,
            2 * (away @ speed),
            speed @ speed + 2 * (away @ half),
            2 * (speed @ half),
            half @ half,
        ]

    def facing(self, place: Vector) -> Vector:
        """Unit normal at a touch."""
        away = place - self.middle
        return away / (away @ away).sqrt()


@dataclass(frozen=True)
class Flown:
    """Flights (k,) from a place and with a speed each, and what was struck at the end of each."""

    begins: list[Decimal]
    places: list[Vector]
    speeds: list[Vector]
    struck: list[Wall | Pin]
    half: Vector

    @property
    def quiet(self) -> float:
        """Instant (s) of the third strike of a pin, or the last of fewer: errors are small."""
        pins = (
            begin
            for begin, one in zip(self.begins[1:], self.struck, strict=True)
            if isinstance(one, Pin)
        )
        return float(max(list(pins)[:3], default=0.0))

    def __call__(self, time: FloatArray) -> ComplexArray:
        """Return complex places (n,) at instants (n,)."""
        flight = np.searchsorted([float(t) for t in self.begins[1:]], time, side="right")
        place, speed = (
            np.array(own, dtype=float)[flight] @ (1, 1j) for own in (self.places, self.speeds)
        )
        since = time - np.array(self.begins, dtype=float)[flight]
        return place + speed * since + complex(*self.half) * since**2


def vector(place: complex) -> Vector:
    """Return the exact decimals of floating-point numbers."""
    return np.array([Decimal(place.real), Decimal(place.imag)])


def flown(setup: Setup, obstacles: Sequence[Wall | Pin], end: float, near: float) -> Flown:
    """Fly a ball up to an end (s); each strike gives back a part of the normal speed.

    Raises:
        GrazeError: it passes an obstacle nearer than `near` (m), or begins there; or too often.

    """
    half, last = vector(-0.5j * setup.gravity), Decimal(end)
    run = Flown([Decimal(0)], [vector(setup.place)], [vector(setup.speed)], [], half)
    if min(one.gap(run.places[0]) for one in obstacles) < near:
        raise GrazeError
    while setup.restitution == 1 or len(run.struck) < MOST:
        motion = run.places[-1], run.speeds[-1], half
        looks = [first_fall(one, motion, last - run.begins[-1]) for one in obstacles]
        falls = [fall for fall, _ in looks]
        first = min(falls)
        passed = [gap for fall, turns in looks for t, gap in turns if t <= first or fall == first]
        if min(map(abs, passed)) < near:
            raise GrazeError
        if not first.is_finite():
            return run
        struck = obstacles[falls.index(first)]
        place, speed = _at(motion, first), motion[1] + 2 * half * first
        normal = struck.facing(place)
        run.speeds.append(speed - (1 + Decimal(setup.restitution)) * (normal @ speed) * normal)
        run.begins.append(run.begins[-1] + first)
        run.places.append(place)
        run.struck.append(struck)
    raise GrazeError


def first_fall(
    obstacle: Wall | Pin, motion: tuple[Vector, ...], end: Decimal
) -> tuple[Decimal, list[tuple[Decimal, Decimal]]]:
    """Find when a gap first falls to zero, infinite if it does not, and its turns up to the next.

    Between turns a polynomial has one zero at most: turns are real parts of the zeros of its slope,
    so instants, with the gap there.
    """
    polynomial = obstacle.polynomial(*motion)
    slope = [k * own for k, own in enumerate(polynomial)][1:]
    turns = sorted(Decimal(float(t)) for t in np.roots([float(own) for own in slope[::-1]]).real)
    begin, seen = Decimal(0), []  # where it has just been left the gap is zero, and rises
    for stop in [*(t for t in turns if 0 < t < end), end]:
        seen.append((stop, obstacle.gap(_at(motion, stop))))
        if _value(polynomial, stop) < 0:
            return _zero(polynomial, begin, stop), seen
        begin = stop
    return Decimal("Infinity"), seen


def _zero(polynomial: list[Decimal], above: Decimal, below: Decimal) -> Decimal:
    for _ in range(HALVINGS):
        middle = (above + below) / 2
        above, below = (above, middle) if _value(polynomial, middle) < 0 else (middle, below)
    return below


def _value(polynomial: list[Decimal], t: Decimal) -> Decimal:
    total = Decimal(0)
    for coefficient in polynomial[::-1]:
        total = total * t + coefficient
    return total


def _at(motion: tuple[Vector, ...], t: Decimal) -> Vector:
    place, speed, half = motion
    return place + (speed + half * t) * t


# --- what is drawn --------------------------------------------------------------------------------

BALL = """
bodies: {ball: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}}
gravity: $gravity
initial: {positions: {ball: $place}, velocities: {ball: $speed}}
curves:
  pin: {type: circle, centre: $middle, radius: $pin}
"""
LINE = "  {}: {{type: line, from: {}, to: {}}}\n"
PIN = (
    "type: circle_on_circle, circles: [{at: ball.c, radius: $radius}, "
    "{at: ground, place: $middle, radius: $pin}]",
    "type: point_on_curve, point: ball.c, radius: $radius, curve: pin, side: right",
)
ON_LINE = "type: point_on_curve, point: ball.c, radius: $radius, curve: {}, side: left"
CONTACT = "  {}: {{{}, law: {{type: impulse, restitution: $restitution}}}}\n"
GRAVITY = 9.81  # m/s^2
FLOOR = {"floor": (-100 - 0.5j, 100 - 0.5j)}
CORNERS = 0.5 * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j, -1 - 1j])
BOX = {f"wall_{k}": (CORNERS[k], CORNERS[k + 1]) for k in range(4)}


@dataclass(frozen=True)
class Setup:
    """A ball at a place (m) with a speed (m/s), a pin, and lines that the ball is left of."""

    place: complex
    speed: complex
    radius: float
    pin: float
    middle: complex = 0j
    lines: Mapping[str, tuple[complex, complex]] = field(default_factory=dict)
    restitution: float = 1.0
    gravity: float = GRAVITY

    def flown(self, end: float, near: float, *, pinned: bool = True) -> Flown:
        """Fly the ball up to an end (s), with or without the pin."""
        obstacles: list[Wall | Pin] = []
        for begin, stop in self.lines.values():
            normal = 1j * (stop - begin) / abs(stop - begin)
            offset = Decimal((begin * normal.conjugate()).real) + Decimal(self.radius)
            obstacles.append(Wall(vector(normal), offset))
        if pinned:
            far = Decimal(self.radius) + Decimal(self.pin)
            obstacles.append(Pin(vector(self.middle), far))
        return flown(self, obstacles, end, near)

    def drawn(self, rng: Rng, title: str, end: float, tolerance: float) -> Drawn:
        """Write it as a model file, and fly it."""
        lines = "".join(LINE.format(name, *map(pair, own)) for name, own in self.lines.items())
        hits = {"pin": str(rng.choice(PIN)), **{name: ON_LINE.format(name) for name in self.lines}}
        contacts = "".join(CONTACT.format(name, own) for name, own in hits.items())
        run = self.flown(end, near=tolerance)
        names = {name: pair(getattr(self, name)) for name in ("place", "speed", "middle")}
        names |= {name: getattr(self, name) for name in ("radius", "pin", "restitution", "gravity")}
        names |= {"title": title, "end": end, "tolerance": tolerance}
        return drawn(f"{BALL}{lines}contacts:\n{contacts}", "ball.c", run, run.quiet, **names)


def passed(rng: Rng, speed: complex, far: float) -> complex:
    """Draw where a pin is from a ball that all but strikes it, or only just, at this speed."""
    across = speed * rng.choice([-1j, 1j]) / abs(speed)
    return complex(across * far * just_off(rng))


def throw(rng: Rng) -> Drawn:
    """A ball is thrown at a pin, or just past it; long before, and long after."""
    gravity = float(rng.choice([GRAVITY, 0.0], p=[0.8, 0.2]))
    radius, pin = spread(rng, 1e-6, 0.3), spread(rng, 1e-6, 0.3)
    speed = spread(rng, 0.3, 30) * turned(within(rng, -3, 3))  # as it passes
    end = spread(rng, 0.05, 10)
    since = end * within(rng, 0.05, 0.95)
    place = passed(rng, speed, radius + pin) - since * (speed + 0.5j * gravity * since)
    restitution = returned(rng)
    setup = Setup(place, speed + 1j * gravity * since, radius, pin)
    setup = replace(setup, restitution=restitution, gravity=gravity)
    return setup.drawn(rng, "throw", end, spread(rng, 1e-8, 1e-5))


def hops(rng: Rng) -> Drawn:
    """A ball hops along a floor, and meets a pin in one of its hops, or just not."""
    radius, pin, end = spread(rng, 0.003, 0.2), spread(rng, 0.003, 0.2), spread(rng, 1, 10)
    place = complex(within(rng, -2, 2), radius - 0.5 + spread(rng, 0.05, 2))
    speed = complex(*rng.uniform(-3, 3, 2))
    restitution = returned(rng, 0.6)
    setup = Setup(place, speed, radius, pin, lines=FLOOR, restitution=restitution)
    free = setup.flown(end, near=0.0, pinned=False)
    when = end * within(rng, 0.05, 0.95)
    at, ahead = free(np.array([when, when + 1e-6]))
    middle = complex(at) + passed(rng, ahead - at, radius + pin)
    return replace(setup, middle=middle).drawn(rng, "hops", end, spread(rng, 1e-8, 1e-5))


def billiard(rng: Rng) -> Drawn:
    """A ball in a box with a pin, without weight: each strike of the pin makes errors larger."""
    radius, pin = within(rng, 0.03, 0.1), within(rng, 0.08, 0.2)
    middle = complex(*rng.uniform(-0.15, 0.15, 2))
    place = complex(*rng.uniform(radius - 0.5, 0.5 - radius, 2))
    setup = Setup(place, turned(within(rng, -3, 3)), radius, pin, middle, BOX, gravity=0.0)
    return setup.drawn(rng, "billiard", 20.0, 1e-6)
