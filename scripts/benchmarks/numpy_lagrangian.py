"""The chain's equations of motion in plain numpy, integrated by SciPy's DOP853.

What one writes by hand who derives the equations instead of building bodies and joints: absolute
angles of the rods, the first one prescribed, closed forms for the track, the contact's force inside
the right-hand side. Independent of this package; all numbers of the scenes are typed in.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import atan2, cos, pi, sin, sqrt, tanh

import numpy as np
from scipy.integrate import solve_ivp

from exudyn_flexlink.arrays import FloatArray

DENSITY, YOUNG, WIDTH, THICKNESS, LENGTH = 7850.0, 2e11, 0.010, 0.0005, 0.07
SPEED, CRANK_X = 10.0, 0.02  # rad/s, m
A, B, R = 0.04, 0.03, 0.03  # m: semi-axes of the ellipse, radius of the half circle
DAMPING = 2e-5  # N m s/rad, of a hinge

PIVOT_X, LEVER = -0.138, 0.03  # m
LEVER_INERTIA = DENSITY * 0.010 * 0.001 * LEVER**3 / 3  # about the pivot
LEVER_SPRING = LEVER_INERTIA * (2 * pi * 40) ** 2
LEVER_DAMPING = 2 * 0.1 * sqrt(LEVER_SPRING * LEVER_INERTIA)
STIFFNESS, RESTITUTION, TRANSITION = 2e4, 0.5, 5e-3  # N/m, -, m/s
MEET = atan2(B, -CRANK_X)  # rad: direction from the crank in which ellipse and circle meet
DEEPEST = -1e-3  # m: S deeper than this has fallen off the lever, and is below it


@dataclass(frozen=True)
class Link:
    """n equal rods: couplings (n, n) kg m^2 and first moments (n,) kg m of their masses.

    `hinges` (n, n) turns angles into -1 times the torques of hinges of stiffness 1.
    """

    rods: int = 10
    damping: float = 0.0
    couplings: FloatArray = field(init=False)
    firsts: FloatArray = field(init=False)
    hinges: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        n, mass = self.rods, self.mass
        arms = self.length * (np.tri(n, k=-1) + 0.5 * np.eye(n))
        object.__setattr__(self, "couplings", mass * arms.T @ arms)
        object.__setattr__(self, "firsts", mass * arms.sum(axis=0))
        bend = np.diff(np.eye(n), axis=0)
        object.__setattr__(self, "hinges", bend.T @ bend)

    @property
    def length(self) -> float:
        """Length of a rod, m."""
        return LENGTH / self.rods

    @property
    def mass(self) -> float:
        """Mass of a rod, kg."""
        return DENSITY * WIDTH * THICKNESS * self.length

    @property
    def inertia(self) -> float:
        """Moment of inertia of a rod about its centre, kg m^2."""
        return self.mass * self.length**2 / 12

    @property
    def stiffness(self) -> float:
        """Stiffness of a hinge, N m/rad: E I over the length of a rod."""
        return YOUNG * WIDTH * THICKNESS**3 / 12 / self.length

    def accelerations(
        self,
        angles: FloatArray,
        rates: FloatArray,
        lift: tuple[float, float],
        force: tuple[float, float] = (0.0, 0.0),
    ) -> FloatArray:
        """Second derivatives (n - 1,) of the angles of rods 2 to n, the first one's being 0.

        `lift` is the acceleration of P less that of weight, `force` (N) acts on the end S.
        """
        c, s = np.cos(angles), np.sin(angles)
        # cos and sin of all differences, by products
        matrix = self.couplings * (np.outer(c, c) + np.outer(s, s))
        terms = (self.couplings * (np.outer(s, c) - np.outer(c, s))) @ rates**2
        terms += self.firsts * (c * lift[1] - s * lift[0])
        terms += self.hinges @ (self.stiffness * angles + self.damping * rates)
        terms -= self.length * (c * force[1] - s * force[0])
        matrix[np.diag_indices(self.rods)] += self.inertia
        return np.asarray(np.linalg.solve(matrix[1:, 1:], -terms[1:]))

    def end(self, angles: FloatArray) -> FloatArray:
        """Where S is from P, m; angles (..., n) give (..., 2)."""
        return self.length * np.stack([np.cos(angles).sum(-1), np.sin(angles).sum(-1)], axis=-1)


@dataclass(frozen=True)
class Motion:
    """S (N, 2) m and the lever's angle (N,) rad at instants (N,) s, and how often it was asked."""

    time: FloatArray
    position: FloatArray
    lever_angle: FloatArray
    evaluations: int


def ring(weight: float, time: FloatArray, tolerance: float) -> Motion:
    """The chain, straight along x, held by its first rod and let go under a weight (m/s^2) in y."""
    link = Link()
    n = link.rods - 1
    angles, rates = np.zeros(link.rods), np.zeros(link.rods)

    def rate(_t: float, y: FloatArray) -> FloatArray:
        angles[1:], rates[1:] = y[:n], y[n:]
        return np.concatenate([y[n:], link.accelerations(angles, rates, (0.0, -weight))])

    found = solve_ivp(
        rate, (0, time[-1]), np.zeros(2 * n), "DOP853", time, rtol=tolerance, atol=tolerance / 100
    )
    bent = np.column_stack([np.zeros(len(time)), found.y[:n].T])
    return Motion(time, np.array([A, 0.0]) + link.end(bent), np.zeros(len(time)), found.nfev)


# --- the strike ------------------------------------------------------------------------------


def on_circle(theta: float) -> bool:
    """Whether P is on the half circle: on the left, in even laps."""
    lap, angle = divmod(theta, 2 * pi)
    return lap % 2 == 1 and MEET < angle < 2 * pi - MEET


def root(theta: float, circle: bool) -> tuple[float, float, float]:
    """Distance r (m) of P from the crank along the link, and its derivatives by theta."""
    a, b = (R, R) if circle else (A, B)
    c, s = cos(theta), sin(theta)
    # p r^2 + 2 q r + k = 0 on the conic, and that differentiated twice
    bend = 1 / b**2 - 1 / a**2
    p, p1, p2 = (c / a) ** 2 + (s / b) ** 2, 2 * c * s * bend, 2 * (c * c - s * s) * bend
    q, q1 = CRANK_X * c / a**2, -CRANK_X * s / a**2
    r = (sqrt(q * q - p * ((CRANK_X / a) ** 2 - 1)) - q) / p
    slope = 2 * (p * r + q)
    r1 = -(p1 * r * r + 2 * q1 * r) / slope
    r2 = -(p2 * r * r + 4 * p1 * r * r1 + 2 * p * r1 * r1 - 2 * q * r + 4 * q1 * r1) / slope
    return r, r1, r2


class Strike:
    """Link and lever, the crank's speed prescribed; the state is angles, lever, and their rates."""

    def __init__(self) -> None:
        self.link = Link(damping=DAMPING)
        self.circle = False
        self._angles, self._rates = np.zeros(self.link.rods), np.full(self.link.rods, SPEED)

    @property
    def start(self) -> FloatArray:
        """Straight along the crank and turning with it, the lever at rest."""
        n = self.link.rods
        return np.concatenate([np.zeros(n), np.full(n - 1, SPEED), [0.0]])

    def rate(self, t: float, y: FloatArray) -> FloatArray:
        """dy/dt."""
        n = self.link.rods
        theta = SPEED * t
        self._angles[0], self._angles[1:] = theta, y[: n - 1]
        self._rates[1:] = y[n:-1]
        r, r1, r2 = root(theta, self.circle)
        c, s = cos(theta), sin(theta)
        along, across = (r2 - r) * SPEED**2, 2 * r1 * SPEED**2
        lift = along * c - across * s, along * s + across * c
        force, torque = self._contact(y, (r, r1, c, s))
        found = self.link.accelerations(self._angles, self._rates, lift, force)
        psi, spin = y[n - 1], y[-1]
        turned = (torque - LEVER_SPRING * psi - LEVER_DAMPING * spin) / LEVER_INERTIA
        return np.concatenate([y[n:], found, [turned]])

    def _contact(
        self, y: FloatArray, at: tuple[float, float, float, float]
    ) -> tuple[tuple[float, float], float]:
        """Force on S (N) and torque on the lever (N m)."""
        r, r1, c, s = at
        cosines, sines = np.cos(self._angles), np.sin(self._angles)
        length = self.link.length
        dx = CRANK_X + r * c + length * cosines.sum() - PIVOT_X
        dy = r * s + length * sines.sum()
        tx, ty = cos(y[self.link.rods - 1]), sin(y[self.link.rods - 1])
        gap, place = tx * dy - ty * dx, tx * dx + ty * dy
        if not DEEPEST < gap < 0 or not 0 <= place <= LEVER:
            return (0.0, 0.0), 0.0
        ux = SPEED * (r1 * c - r * s) - length * sines @ self._rates
        uy = SPEED * (r1 * s + r * c) + length * cosines @ self._rates
        closing = -(tx * uy - ty * ux - y[-1] * place)
        e2 = RESTITUTION**2
        rising = tanh(closing / TRANSITION)
        force = -STIFFNESS * gap * ((1 + e2) / 2 + (1 - e2) / 2 * rising)
        return (-ty * force, tx * force), -force * place

    def end(self, time: FloatArray, y: FloatArray) -> FloatArray:
        """Place of S (N, 2), m."""
        theta = SPEED * time
        r = np.array([root(angle, on_circle(angle))[0] for angle in theta])
        angles = np.column_stack([theta, y[: self.link.rods - 1].T])
        directions = np.column_stack([np.cos(theta), np.sin(theta)])
        return np.array([CRANK_X, 0.0]) + r[:, None] * directions + self.link.end(angles)


def strike(time: FloatArray, tolerance: float) -> Motion:
    """The strike of models/no_clearance.yaml with `beam` hinges at instants (N,) s from 0 on."""
    system = Strike()
    # The curvature of the track jumps where the half circle begins and ends.
    jumps = [(lap * 2 * pi + turn) / SPEED for lap in (1, 3) for turn in (MEET, 2 * pi - MEET)]
    breaks = [0.0, *(t for t in jumps if t < time[-1]), time[-1]]
    y, states, asked = system.start, [], 0
    for begin, end in pairwise(breaks):
        system.circle = on_circle(SPEED * (begin + end) / 2)
        inside = time[(time > begin) & (time < end)]
        found = solve_ivp(
            system.rate,
            (begin, end),
            y,
            "DOP853",
            np.concatenate([[begin], inside, [end]]),
            rtol=tolerance,
            atol=tolerance / 100,
        )
        y, asked = found.y[:, -1], asked + found.nfev
        kept = np.isin(found.t, time) & (found.t < end)
        states.append(found.y[:, kept])
    seen = np.column_stack([*states, y])
    return Motion(time, system.end(time, seen), seen[system.link.rods - 1], asked)
