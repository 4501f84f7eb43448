"""Closed forms: integrals of pulses and tables, oscillators between bends, splines around a hub."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import erf, spence

from exudyn_flexlink.arrays import FloatArray

Twice = tuple[FloatArray, FloatArray]
"""First and second antiderivative of a shape at u."""


def _gauss(u: FloatArray) -> Twice:
    first = np.sqrt(np.pi) / 2 * erf(u)
    return first, u * first + np.exp(-u * u) / 2


def _hat(u: FloatArray) -> Twice:
    inside = np.clip(u, -1, 1)
    left = 1 - np.abs(inside)
    second = np.where(inside < 0, left**3 / 6, inside + left**3 / 6)
    return np.where(inside < 0, left**2 / 2, 1 - left**2 / 2), second + np.maximum(u - 1, 0)


def _box(u: FloatArray) -> Twice:
    first = np.clip(u, -1, 1) + 1
    return first, first**2 / 2 + 2 * np.maximum(u - 1, 0)


def _plateau(u: FloatArray) -> Twice:
    def twice(z: FloatArray) -> FloatArray:
        far = np.abs(z)
        once = far + np.log1p(np.exp(-2 * far)) - np.log(2)  # log cosh z
        again = far**2 / 2 - far * np.log(2) + (spence(1 + np.exp(-2 * far)) + np.pi**2 / 12) / 2
        return np.array([once, np.sign(z) * again])

    first, second = (twice(u + 1) - twice(u - 1)) / 2
    return first, second


class Shape(NamedTuple):
    """A formula of t with places for a and b, and its antiderivatives by u = (t - a) / b."""

    text: str
    integrals: Callable[[FloatArray], Twice]


SHAPES = {
    "gauss": Shape("exp(-((t-{a})/{b})**2)", _gauss),
    "hat": Shape("max(0, 1-abs((t-{a})/{b}))", _hat),
    "plateau": Shape("(tanh((t-{a})/{b}+1)-tanh((t-{a})/{b}-1))/2", _plateau),
    "box": Shape("where(abs(t-{a}) < {b}, 1, 0)", _box),
    "steps": Shape("where(t-{a} < -{b}, 0, where(t-{a} < {b}, 1, 0))", _box),
    "early": Shape("where(t-{a} < {b}, 1, 0)", _box),  # with a = b: from 0 on
    "level": Shape("1", lambda u: (u, u * u / 2)),  # the others with a = 0
    "wave": Shape("sin(t/{b})", lambda u: (-np.cos(u), -np.sin(u))),
    "decay": Shape("exp(-t/{b})", lambda u: (-np.exp(-u), np.exp(-u))),
}


class Term(NamedTuple):
    """`size` times a shape around the time `at` (s), so `wide` (s)."""

    shape: str
    at: float
    wide: float
    size: float

    @property
    def text(self) -> str:
        """The term as a formula, with its sign."""
        return f"{self.size:+}*" + SHAPES[self.shape].text.format(a=self.at, b=self.wide)

    def integral(self, time: FloatArray, order: int) -> FloatArray:
        """First or second integral from 0 to times (n,)."""
        of = SHAPES[self.shape].integrals
        now, then = of((time - self.at) / self.wide), of(np.array(-self.at / self.wide))
        found = now[order - 1] - then[order - 1]
        if order == 2:
            found = found - then[0] * time / self.wide
        return self.size * self.wide**order * found

    def resonant(self, time: FloatArray, w: float) -> FloatArray:
        """Motion (n,) that it makes of x'' + w^2 x = term, from rest at 0; a Gaussian's."""
        u, shift = (time - self.at) / self.wide, 0.5j * w * self.wide
        grown = erf(u + shift) - erf(-self.at / self.wide + shift)
        area = self.size * self.wide * np.sqrt(np.pi) / 2 * np.exp(-((w * self.wide / 2) ** 2))
        return np.asarray(area / w * np.imag(np.exp(1j * w * (time - self.at)) * grown))


class Bent(NamedTuple):
    """A force that bends with the state: constant - linear x - damper max(0, v) - hinges.

    Of a hinge (k, g, s) it is k s max(0, s (x - g)), with s = 1 or -1.
    """

    linear: float = 0.0
    constant: float = 0.0
    hinges: tuple[tuple[float, float, int], ...] = ()
    damper: float = 0.0

    def swing(self, mass: float, x: float, v: float, time: FloatArray) -> tuple[FloatArray, int]:
        """Places (n,) of a mass at times (n,) from 0, and how many bends it passed.

        From bend to bend, and from turn to turn, it is a free oscillator.
        """
        found, t, passed = np.zeros_like(time), 0.0, 0
        bends = [-np.inf, *(g for _, g, _ in self.hinges), np.inf]
        while True:
            way = np.sign(v) or np.sign(self.force(x))
            low = max(g for g in bends if g < x or (g == x and way > 0))
            high = min(g for g in bends if g > x or (g == x and way < 0))
            acting = [(k, g) for k, g, s in self.hinges if (low >= g if s > 0 else high <= g)]
            stiffness = self.linear + sum(k for k, _ in acting)
            push = self.constant + sum(k * g for k, g in acting)
            damping = self.damper if way > 0 else 0.0
            moved, span = _free(stiffness / mass, push / mass, damping / mass, x, v)
            span, bend = min(span, time[-1] - t), (high if way > 0 else low)
            passes = np.isfinite(bend) and (moved(span)[0] - bend) * way > 0
            if passes:
                span = brentq(lambda s, m=moved, b=bend: m(s)[0] - b, 0, span, xtol=1e-18)
            inside = (time >= t) & (time <= t + span)
            found[inside] = moved(time[inside] - t)[0]
            if t + span >= time[-1]:
                return found, passed
            x, v = (bend, moved(span)[1]) if passes else (moved(span)[0], 0.0)
            t, passed = t + span, passed + passes

    def force(self, x: float, v: float = 0.0) -> float:
        """Force (N) at a place (m) and a speed (m/s)."""
        bent = sum(k * s * max(0.0, s * (x - g)) for k, g, s in self.hinges)
        return self.constant - self.linear * x - self.damper * max(0.0, v) - bent


def _free(k: float, push: float, c: float, x: float, v: float) -> tuple[Callable, float]:
    """Place and speed by time of x'' + c x' + k x = push, and when it turns next."""
    if k == 0:
        turn = -v / push if v * push < 0 else np.inf
        return (lambda s: (x + v * s + push * s**2 / 2, v + push * s)), turn
    d, middle = c / 2, push / k
    w, y = np.sqrt(k - d**2), x - middle
    a, b = (v + d * y) / w, (d * v + k * y) / w

    def moved(s: FloatArray) -> Twice:
        fades, cos, sin = np.exp(-d * s), np.cos(w * s), np.sin(w * s)
        return middle + fades * (y * cos + a * sin), fades * (v * cos - b * sin)

    return moved, (np.arctan2(v, b) % np.pi or np.pi) / w


def radius_at(points: FloatArray, angle: FloatArray) -> FloatArray:
    """Distance (n,) from the origin, in directions (n,), of the closed spline around it."""
    through = np.vstack([points, points[:1]])
    spline = CubicSpline(_along(through), through, bc_type="periodic")
    u = np.linspace(0, spline.x[-1], 4001)
    seen = np.unwrap(np.arctan2(*spline(u).T[::-1]))
    u = np.interp(seen[0] + np.mod(angle - seen[0], 2 * np.pi), seen, u)
    for _ in range(5):  # of Newton's method
        (x, y), (dx, dy) = spline(u).T, spline(u, 1).T
        u = u - (y * np.cos(angle) - x * np.sin(angle)) / (dy * np.cos(angle) - dx * np.sin(angle))
    return np.asarray(np.linalg.norm(spline(u), axis=1))


def open_spline(points: FloatArray) -> FloatArray:
    """Many places (n, 2) of the open spline through points."""
    along = _along(points)
    return np.asarray(CubicSpline(along, points)(np.linspace(0, along[-1], 4001)))


def _along(points: FloatArray) -> FloatArray:
    return np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
