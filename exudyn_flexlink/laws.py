"""Contact laws: forces of contacts that give way, by different authors, and restitution by impulse.

A force follows from the penetration ``d`` (m, positive inside), its rate ``d'`` (m/s, positive
while approaching) and the approach speed ``v0`` (m/s) with which this touch began. That speed is
all the history that is kept: it belongs to the touch, and stays as it is until the touch ends. The
energy that a contact stores follows from ``d`` alone. That parameters are within their ranges is
checked where they are read, in the scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, log1p
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import lambertw

from exudyn_flexlink.arrays import FloatArray

Slopes = tuple[FloatArray, FloatArray, FloatArray]
"""Forces (N), and how they rise with penetration (N/m) and with its rate (N s/m)."""
ELASTIC = 1e-6  # of a factor: below it closed forms lose more digits than their series leaves out
BELOW_ONE = 1 - 1e-15
NEAREST = 1e-3  # to the greatest depth of `LineContact`, as a part of it: from there on it is over


@dataclass(frozen=True)
class RestitutionPenalty:
    """Penalty spring whose unloading is softer than its loading, so that an impact returns ``e v``.

    ``F = k d [(1 + e^2)/2 + (1 - e^2)/2 tanh(d'/v_s)]`` for ``d > 0``, else 0. Loading follows
    ``k``, unloading ``e^2 k``, hence the returned energy is ``e^2`` of the input when the speed
    before, ``v``, and after, ``e v``, are both well above ``v_s``.

    Parameters are ``stiffness`` k (N/m, > 0), ``restitution`` e (0 to 1) and ``transition_speed``
    v_s (m/s, > 0).
    """

    stiffness: float
    restitution: float
    transition_speed: float = 5e-3
    deepest: ClassVar[float] = inf
    exponent: ClassVar[float] = 1.0

    def force(
        self,
        penetration: ArrayLike,
        rate: ArrayLike,
        approach_speed: ArrayLike = 0.0,  # noqa: ARG002
    ) -> FloatArray:
        """Pressing force in N (never negative), of the broadcast shape of the first arguments.

        With e = 0 a mass still leaves, at a few ``v_s``: the force fades as ``exp(-2 v/v_s)`` only
        once it recedes.
        """
        d, relative = np.maximum(penetration, 0.0), np.asarray(rate) / self.transition_speed
        return np.asarray(d * (self.elastic + self.lossy * np.tanh(relative)))

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy U = (1 + e^2)/2 k d^2/2 in J of the conservative part of the force.

        It is the only multiple of ``d^2`` whose remainder ``F d' - dU/dt`` never turns negative:
        with ``e^2 k d^2/2`` slow unloading (``|d'| ~ v_s``) would seem to create energy.
        """
        d = np.maximum(penetration, 0.0)
        return np.asarray(0.5 * self.elastic * d**2)

    def half_period(self, mass: float) -> float:
        """Half a period pi sqrt(m/k) in s of ``mass`` (kg): what steps per contact refer to."""
        return math.pi * math.sqrt(mass / self.stiffness)

    @property
    def elastic(self) -> float:
        """Part of the stiffness that gives back what it takes, N/m."""
        return 0.5 * self.stiffness * (1 + self.restitution**2)

    @property
    def lossy(self) -> float:
        """Part of the stiffness that loading adds and unloading takes away, N/m."""
        return 0.5 * self.stiffness * (1 - self.restitution**2)


@dataclass(frozen=True)
class PowerPenalty:
    """``F = K d^n (1 + (a/v0) d')`` where that is positive, else 0: Hertz's law with damping.

    Parameters are ``stiffness`` K (N/m^n, > 0), ``exponent`` n (1 or more), ``factor`` a (0 or
    more, see `damping_factor`) and ``transition_speed`` (m/s, > 0), the least v0 that counts:
    without it a touch that begins softly would be damped without bounds.

    An impact faster than that returns `restitution`. Its force never turns negative, but it would
    where something else drags the bodies apart faster than v0/a.
    """

    stiffness: float
    exponent: float = 1.5
    factor: float = 0.0
    transition_speed: float = 1e-3
    deepest: ClassVar[float] = inf

    def force(
        self, penetration: ArrayLike, rate: ArrayLike, approach_speed: ArrayLike
    ) -> FloatArray:
        """Pressing force in N (never negative), of the broadcast shape of the arguments."""
        return np.maximum(self.pressing(penetration, rate, approach_speed)[0], 0.0)

    def pressing(
        self, penetration: ArrayLike, rate: ArrayLike, approach_speed: ArrayLike
    ) -> Slopes:
        """Force and slopes; the force goes on smoothly, to negative ones, where a gap has opened.

        There a touch ends, within a step.
        """
        d, speed = np.asarray(penetration), np.maximum(approach_speed, self.transition_speed)
        damped = 1 + self.factor * np.asarray(rate) / speed
        spring, pushes = self.stiffness * np.abs(d) ** (self.exponent - 1), damped > 0
        by_rate = np.maximum(d, 0.0) * spring * self.factor / speed * pushes
        spring = spring * damped * pushes
        return d * spring, self.exponent * spring, by_rate

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy U = K d^(n+1)/(n+1) in J: that of the force without damping."""
        power = self.exponent + 1
        return np.asarray(self.stiffness * np.maximum(penetration, 0.0) ** power / power)

    def half_period(self, mass: float) -> float:
        """How long (s) a contact of `mass` (kg) lasts without losses, at an approach of 1 m/s.

        It goes as v0^-((n - 1)/(n + 1)).
        """
        root = 1 / (self.exponent + 1)
        depth = ((self.exponent + 1) * mass / (2 * self.stiffness)) ** root
        shape = math.gamma(1 + root) / math.gamma(0.5 + root)
        return float(2 * math.sqrt(math.pi) * shape * depth)

    @property
    def restitution(self) -> float:
        """Speed after an impact over speed before, as the law really gives it."""
        return restitution_of(self.factor)


@dataclass(frozen=True)
class LineContact:
    """Two cylinders side by side: ``d = q/(pi E) ln(c/q)`` with the load q = F/length, no losses.

    Parameters are ``modulus`` E, both bodies' together (Pa, > 0), ``length`` (m, > 0) and ``bound``
    c (N/m, > 0), in which Johnson's and Radzimovsky's formulas differ. The depth d grows with the
    load up to ``c/(pi E exp(1))`` alone: beyond `deepest` a run fails. Steps that are tried there
    see the tangent.
    """

    modulus: float
    length: float
    bound: float
    exponent: ClassVar[float] = 1.0  # near enough, for slopes of friction
    restitution: ClassVar[float] = 1.0

    @property
    def deepest(self) -> float:
        """Penetration (m) up to which there is a force, but for a thousandth."""
        return (1 - NEAREST) * self.bound / (math.pi * self.modulus * math.e)

    def force(
        self, penetration: ArrayLike, rate: ArrayLike, approach_speed: ArrayLike
    ) -> FloatArray:
        """Pressing force in N (never negative), of the broadcast shape of the arguments."""
        return np.maximum(self.pressing(penetration, rate, approach_speed)[0], 0.0)

    def pressing(
        self,
        penetration: ArrayLike,
        rate: ArrayLike,
        approach_speed: ArrayLike,  # noqa: ARG002
    ) -> Slopes:
        """Force and slopes; the force goes on smoothly, to negative ones, where a gap has opened.

        It does not depend on the approach speed.
        """
        d = np.asarray(penetration) + 0.0 * np.asarray(rate)
        depth = np.minimum(np.abs(d), self.deepest)
        logarithm = self._logarithm(depth)
        stiff = math.pi * self.modulus * self.length
        slope = stiff / (logarithm - 1)
        force = stiff * depth / logarithm + slope * (np.abs(d) - depth)
        return np.sign(d) * force, slope, np.zeros(d.shape)

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy U = q^2 length/(2 pi E) (ln(c/q) - 1/2) in J."""
        depth = np.maximum(penetration, 0.0)
        logarithm = self._logarithm(depth)
        load = math.pi * self.modulus * depth / logarithm
        with np.errstate(invalid="ignore"):  # 0 times the infinite logarithm of no load
            found = self.length * load**2 / (2 * math.pi * self.modulus) * (logarithm - 0.5)
        return np.where(depth > 0, found, 0.0)

    def half_period(self, mass: float) -> float:
        """How long (s) a contact of `mass` (kg) lasts at least, however deep it is."""
        return math.pi * math.sqrt(mass / (math.pi * self.modulus * self.length))

    def _logarithm(self, depth: FloatArray) -> FloatArray:
        """ln(c/q), from 1 up, at a depth (m) that is `deepest` at most."""
        part = np.minimum(depth, self.deepest) * math.pi * self.modulus / self.bound
        return np.asarray(-lambertw(-part, -1).real)


Penalty = RestitutionPenalty | PowerPenalty | LineContact
"""Laws of contacts that give way."""


def restitution_of(factor: float) -> float:
    """Speed after an impact over speed before, by the factor a of `PowerPenalty`.

    It solves ``a (1 + e) = ln[(1 + a)/(1 - a e)]``: the same penetration is reached from both
    speeds in the plane of depth and rate (D. W. Marhefka, D. E. Orin, IEEE Trans. Syst. Man Cybern.
    A 29 (1999) 566). Stiffness, exponent, mass and speed have no part in it.
    """
    if factor < ELASTIC:
        return 1 - 2 * factor / 3
    most = min(1.0, BELOW_ONE / factor)
    if _unbalanced(factor, most) <= 0:
        return most
    return float(brentq(lambda e: _unbalanced(factor, e), 0.0, most, xtol=1e-16))


def _unbalanced(factor: float, restitution: float) -> float:
    """Right side less left side of the equation that `restitution_of` solves."""
    back = factor * restitution
    return (log1p(factor) - factor) - (log1p(-back) + back)


def _exact(restitution: float) -> float:
    """Factor that returns the restitution asked."""
    low = 1.5 * (1 - restitution)  # returns more than asked
    high = BELOW_ONE / restitution
    if low < ELASTIC or _unbalanced(high, restitution) <= 0:
        return low if low < ELASTIC else high
    return float(brentq(lambda a: _unbalanced(a, restitution), low, high, xtol=1e-16))


FACTORS: dict[str, Callable[[float], float]] = {
    "hunt_crossley": lambda e: 1.5 * (1 - e),
    "lankarani_nikravesh": lambda e: 0.75 * (1 - e * e),
    "flores": lambda e: 1.6 * (1 - e) / e,
    "gonthier": lambda e: (1 - e * e) / e,
    "exact": _exact,
}
"""Factors a of `PowerPenalty` by the restitution e that is asked (0 to 1; above 0 of the last 3).

K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440; H. M. Lankarani, P. E. Nikravesh,
J. Mech. Des. 112 (1990) 369; P. Flores et al., Multibody Syst. Dyn. 25 (2011) 357; Y. Gonthier et
al., Multibody Syst. Dyn. 11 (2004) 209.
"""


@dataclass(frozen=True)
class Friction:
    """Coulomb friction, regularised: ``T = -mu F tanh(s/s_0)`` against the slip ``s`` (m/s).

    Below about the slip speed ``s_0`` (m/s, > 0) the contact creeps instead of sticking.
    """

    coefficient: float
    slip_speed: float

    def force(self, pressing: ArrayLike, slip: ArrayLike) -> FloatArray:
        """Force in N along the face, against the slip, of the broadcast shape of both arguments."""
        ratio = np.asarray(slip, dtype=float) / self.slip_speed
        return np.asarray(-self.coefficient * np.asarray(pressing) * np.tanh(ratio))


@dataclass(frozen=True)
class Impulse:
    """Rigid contact: an impact returns ``e v`` at once (paper, eq. 4); pushing leaves no gap."""

    restitution: float
