"""Contact laws: forces of compliant contacts, by different authors, and restitution by impulse.

A force follows from the penetration ``d`` (m, positive inside), its rate ``d'`` (m/s, positive
while approaching) and the approach speed ``v0`` (m/s) at the begin of the touch. A law needs no
other history; ``v0`` does not change until the touch ends. The energy stored in a contact follows
from ``d`` alone. The scene checks the ranges of parameters when it reads them.

The restitution of a damped law follows from its factor; `FACTORS` has those of some authors.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, log1p
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.rounding import UNIT_ROUNDING

ELASTIC = 1e-6  # a factor: below it closed forms lose digits, and the series is more exact


def restitution_of(factor: float) -> float:
    """Speed after an impact over speed before, by the factor a of `laws.PowerPenalty`.

    It solves ``a (1 + e) = ln[(1 + a)/(1 - a e)]``: the speeds before and after the impact reach
    the same penetration (D. W. Marhefka, D. E. Orin, IEEE Trans. Syst. Man Cybern. A 29 (1999)
    566). It is independent of stiffness, exponent, mass and speed.
    """
    if factor < ELASTIC:
        return 1 - 2 * factor / 3
    most = min(1.0, (1 - UNIT_ROUNDING) / factor)
    if _unbalanced(factor, most) <= 0:
        return most
    return _root(lambda e: _unbalanced(factor, e), 0.0, most)


def _unbalanced(factor: float, restitution: float) -> float:
    """Right side minus left side of the equation that `restitution_of` solves."""
    back = factor * restitution
    return (log1p(factor) - factor) - (log1p(-back) + back)


def _exact(restitution: float) -> float:
    """Factor with which an impact has exactly this restitution."""
    low = 1.5 * (1 - restitution)  # gives a larger restitution
    high = (1 - UNIT_ROUNDING) / restitution
    if low < ELASTIC or _unbalanced(high, restitution) <= 0:
        return low if low < ELASTIC else high
    return _root(lambda a: _unbalanced(a, restitution), low, high)


def _root(of: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import brentq  # noqa: PLC0415 - takes a second, which `check` saves

    return float(brentq(of, low, high, xtol=1e-16))


FACTORS: dict[str, Callable[[float], float]] = {
    "hunt_crossley": lambda e: 1.5 * (1 - e),
    "lankarani_nikravesh": lambda e: 0.75 * (1 - e * e),
    "flores": lambda e: 1.6 * (1 - e) / e,
    "gonthier": lambda e: (1 - e * e) / e,
    "exact": _exact,
}
"""Factors a of `laws.PowerPenalty` for a restitution e (0 to 1; not 0 for the last three).

K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440; H. M. Lankarani, P. E. Nikravesh,
J. Mech. Des. 112 (1990) 369; P. Flores et al., Multibody Syst. Dyn. 25 (2011) 357; Y. Gonthier et
al., Multibody Syst. Dyn. 11 (2004) 209.
"""


Slopes = tuple[FloatArray, FloatArray, FloatArray]
"""Forces (N), and their slopes by penetration (N/m) and by its rate (N s/m)."""
NEAREST = 1e-3  # of the greatest depth of `LineContact`: a run ends this near to it


class GivingWay(ABC):
    """A compliant contact: its force depends on d, d' and the approach speed v0.

    If it `lets_go`, a touch ends when the force becomes zero, else when the penetration does.
    """

    lets_go: ClassVar[bool] = False

    @abstractmethod
    def pressing(
        self, penetration: ArrayLike, rate: ArrayLike, approach_speed: ArrayLike
    ) -> Slopes:
        """Force and slopes, of one shape.

        Within a step the force is continued smoothly beyond the end of a touch.
        """

    @abstractmethod
    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy (J) that the contact returns without damping."""

    @abstractmethod
    def half_period(self, mass: float) -> float:
        """Duration (s) of a contact of `mass` (kg), to which steps per contact refer."""

    def force(
        self, penetration: ArrayLike, rate: ArrayLike, approach_speed: ArrayLike
    ) -> FloatArray:
        """Pressing force in N (never negative), of the broadcast shape of the arguments."""
        pressed = self.pressing(penetration, rate, approach_speed)[0]
        return np.where(np.asarray(penetration) > 0, np.maximum(pressed, 0.0), 0.0)

    @property
    def deepest(self) -> float:
        """Largest penetration (m) with a force."""
        return inf

    @property
    def exponent(self) -> float:
        """Approximate power of the penetration, for slopes of friction."""
        return 1.0


@dataclass(frozen=True)
class RestitutionPenalty(GivingWay):
    """Penalty spring whose unloading is softer than its loading, so that an impact returns ``e v``.

    ``F = k d [(1 + e^2)/2 + (1 - e^2)/2 tanh(d'/v_s)]`` for ``d > 0``, else 0. Loading follows
    ``k``, unloading ``e^2 k``. So the returned energy is ``e^2`` of the input if the speeds before,
    ``v``, and after, ``e v``, are both well above ``v_s``.

    Parameters are ``stiffness`` k (N/m, > 0), ``restitution`` e (0 to 1) and ``transition_speed``
    v_s (m/s, > 0).
    """

    stiffness: float
    restitution: float
    transition_speed: float = 5e-3

    def pressing(self, penetration: ArrayLike, rate: ArrayLike, _approach: ArrayLike) -> Slopes:
        """Force and slopes, whatever the approach speed.

        With e = 0 a mass still leaves, at a few ``v_s``: the force fades as ``exp(-2 v/v_s)`` only
        while the mass recedes.
        """
        d, rising = np.asarray(penetration), np.tanh(np.asarray(rate) / self.transition_speed)
        stiffness = self.elastic + self.lossy * rising
        by_rate = np.maximum(d, 0.0) * self.lossy / self.transition_speed * (1 - rising * rising)
        return d * stiffness, stiffness, by_rate

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy U = (1 + e^2)/2 k d^2/2 in J of the conservative part of the force.

        It is the only multiple of ``d^2`` with a remainder ``F d' - dU/dt`` that is never negative.
        With ``e^2 k d^2/2``, slow unloading (``|d'| ~ v_s``) would seem to create energy.
        """
        d = np.maximum(penetration, 0.0)
        return np.asarray(0.5 * self.elastic * d**2)

    def half_period(self, mass: float) -> float:
        """Half a period pi sqrt(m/k), s, of ``mass`` (kg), to which steps per contact refer."""
        return math.pi * math.sqrt(mass / self.stiffness)

    @property
    def elastic(self) -> float:
        """Conservative part of the stiffness, N/m."""
        return 0.5 * self.stiffness * (1 + self.restitution**2)

    @property
    def lossy(self) -> float:
        """Part of the stiffness, N/m, that is added in loading and subtracted in unloading."""
        return 0.5 * self.stiffness * (1 - self.restitution**2)


@dataclass(frozen=True)
class PowerPenalty(GivingWay):
    """``F = K d^n (1 + (a/v0) d')`` if positive, else 0: Hertz's law with damping.

    Parameters are ``stiffness`` K (N/m^n, > 0), ``exponent`` n (1 or more), ``factor`` a (0 or
    more, see `FACTORS`) and ``transition_speed`` (m/s, > 0), the least v0 that counts: without it
    the damping of a slow touch would be unbounded.

    A faster impact has the speed ratio `restitution`. The formula is negative only if other forces
    separate the bodies faster than v0/a.
    """

    stiffness: float
    exponent: float = 1.5
    factor: float = 0.0
    transition_speed: float = 1e-3

    def pressing(
        self, penetration: ArrayLike, rate: ArrayLike, approach_speed: ArrayLike
    ) -> Slopes:
        """Force and slopes; at an open gap the force is negative."""
        d, speed = np.asarray(penetration), np.maximum(approach_speed, self.transition_speed)
        damped = 1 + self.factor * np.asarray(rate) / speed
        spring, pushes = self.stiffness * np.abs(d) ** (self.exponent - 1), damped > 0
        by_rate = np.maximum(d, 0.0) * spring * self.factor / speed * pushes
        spring = spring * damped * pushes
        return d * spring, self.exponent * spring, by_rate

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy U = K d^(n+1)/(n+1), J, of the force without damping."""
        power = self.exponent + 1
        return np.asarray(self.stiffness * np.maximum(penetration, 0.0) ** power / power)

    def half_period(self, mass: float) -> float:
        """Duration (s) of a contact of `mass` (kg) without losses, at an approach of 1 m/s.

        It is proportional to v0^-((n - 1)/(n + 1)).
        """
        root = 1 / (self.exponent + 1)
        depth = ((self.exponent + 1) * mass / (2 * self.stiffness)) ** root
        shape = math.gamma(1 + root) / math.gamma(0.5 + root)
        return float(2 * math.sqrt(math.pi) * shape * depth)

    @property
    def restitution(self) -> float:
        """Actual ratio of the speeds after and before an impact by this law."""
        return restitution_of(self.factor)


@dataclass(frozen=True)
class LineContact(GivingWay):
    """Two cylinders side by side: ``d = q/(pi E) ln(c/q)`` with the load q = F/length, no losses.

    Parameters are ``modulus`` E, that of both bodies together (Pa, > 0), ``length`` (m, > 0) and
    ``bound`` c (N/m, > 0), in which Johnson's and Radzimovsky's formulas differ. The depth d grows
    with the load only up to ``c/(pi E exp(1))``: beyond `deepest` a run fails. In trial steps the
    force beyond it follows the tangent.
    """

    modulus: float
    length: float
    bound: float
    restitution: ClassVar[float] = 1.0

    @property
    def deepest(self) -> float:
        """Largest penetration (m) with a force, minus a thousandth."""
        return (1 - NEAREST) * self.bound / (math.pi * self.modulus * math.e)

    def pressing(self, penetration: ArrayLike, rate: ArrayLike, _approach: ArrayLike) -> Slopes:
        """Force and slopes, whatever the approach speed; at an open gap the force is negative."""
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
        return np.asarray(self.length * load**2 / (2 * math.pi * self.modulus) * (logarithm - 0.5))

    def half_period(self, mass: float) -> float:
        """Least duration (s) of a contact of `mass` (kg), at any depth."""
        return math.pi * math.sqrt(mass / (math.pi * self.modulus * self.length))

    def _logarithm(self, depth: FloatArray) -> FloatArray:
        """ln(c/q), from 1 up, at a depth (m) that is `deepest` at most; finite at 0, too."""
        from scipy.special import lambertw  # noqa: PLC0415 - see `laws`

        part = np.minimum(depth, self.deepest) * math.pi * self.modulus / self.bound
        return np.asarray(-lambertw(-np.maximum(part, np.finfo(float).tiny), -1).real)


@dataclass(frozen=True)
class SpringDamper(GivingWay):
    """One-sided spring and damper, which let go before they pull (Kelvin-Voigt).

    ``F = F_0 + k d + c d'`` while ``d > 0`` and ``F > 0``, else 0: a touch ends when its force
    becomes zero (T. Schwager and T. Poeschel, Granular Matter 9 (2007) 465). Without ``F_0``, and
    with ``z = c/(2 sqrt(k m)) < 1``, an impact returns ``exp(-2 z arccos(z)/sqrt(1 - z^2))`` of the
    speed. The energy in the spring at the end of the touch is lost.

    Parameters are ``stiffness`` k (N/m, > 0), ``damping`` c (N s/m) and ``preload`` F_0 (N); at
    hinges in N m/rad, N m s/rad and N m.
    """

    stiffness: float
    damping: float = 0.0
    preload: float = 0.0
    lets_go: ClassVar[bool] = True

    def pressing(self, penetration: ArrayLike, rate: ArrayLike, _approach: ArrayLike) -> Slopes:
        """Force and slopes, linear also beyond the end of a touch, whatever the approach speed."""
        d, rate = np.broadcast_arrays(penetration, rate)
        force = self.preload + self.stiffness * d + self.damping * rate
        return force, np.full(d.shape, self.stiffness), np.full(d.shape, self.damping)

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy F_0 d + k d^2/2 in J."""
        d = np.maximum(penetration, 0.0)
        return np.asarray(self.preload * d + 0.5 * self.stiffness * d**2)

    def half_period(self, mass: float) -> float:
        """Half a period pi sqrt(m/k) in s of ``mass`` (kg), without the damper."""
        return math.pi * math.sqrt(mass / self.stiffness)


@dataclass(frozen=True)
class SpringTable(GivingWay):
    """As `SpringDamper`, with `forces` (N) at `depths` (m), and linear interpolation between them.

    `depths` begin at 0 and increase; the table ends at the last one.
    """

    depths: tuple[float, ...]
    forces: tuple[float, ...]
    damping: float = 0.0
    lets_go: ClassVar[bool] = True

    def piece(self, number: int) -> SpringDamper:
        """Linear law through two rows of the table."""
        (d, after), (force, next_force) = (
            column[number : number + 2] for column in (self.depths, self.forces)
        )
        slope = (next_force - force) / (after - d)
        return SpringDamper(slope, self.damping, force - slope * d)

    def number(self, penetration: float) -> int:
        """Number of the piece that contains a penetration (m)."""
        return min(max(bisect_right(self.depths, penetration) - 1, 0), len(self.depths) - 2)

    def pressing(self, penetration: ArrayLike, rate: ArrayLike, _approach: ArrayLike) -> Slopes:
        """Force and slopes, whatever the approach speed: linear beyond the first and last row."""
        d, rate = np.broadcast_arrays(penetration, rate)
        k, slopes = self._rows(d), np.diff(self.forces) / np.diff(self.depths)
        begin, force = np.take(self.depths, k), np.take(self.forces, k)
        spring = slopes[k]
        held = force + spring * (d - begin) + self.damping * rate
        return held, spring, np.full(d.shape, self.damping)

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy in J: the area below the table."""
        d = np.maximum(penetration, 0.0)
        areas = np.diff(self.depths) * (np.array(self.forces[1:]) + self.forces[:-1]) / 2
        k = self._rows(d)
        begin, force = np.take(self.depths, k), np.interp(d, self.depths, self.forces)
        before = np.concatenate([[0.0], np.cumsum(areas)])[k]
        return np.asarray(before + (d - begin) * (np.take(self.forces, k) + force) / 2)

    def half_period(self, mass: float) -> float:
        """Half a period in s of ``mass`` (kg) on the steepest piece."""
        slopes = np.abs(np.diff(self.forces) / np.diff(self.depths))
        steepest = max(float(slopes.max()), max(self.forces) / self.depths[-1])
        return math.pi * math.sqrt(mass / steepest)

    def _rows(self, depth: FloatArray) -> IndexArray:
        """Numbers of the pieces that contain depths (m)."""
        k = np.searchsorted(self.depths, depth, side="right") - 1
        return np.asarray(np.clip(k, 0, len(self.depths) - 2))


OneSided = SpringDamper | SpringTable
"""Laws of contacts that let go before they pull."""
Penalty = RestitutionPenalty | PowerPenalty | LineContact | OneSided
"""Laws of compliant contacts."""


@dataclass(frozen=True)
class Friction:
    """Coulomb friction, regularised: ``T = -mu F tanh(s/s_0)`` against the slip ``s`` (m/s).

    Below about the slip speed ``s_0`` (m/s, > 0) the contact creeps instead of sticking.
    """

    coefficient: float
    slip_speed: float

    def force(self, pressing: ArrayLike, slip: ArrayLike) -> FloatArray:
        """Force, N, along the face against the slip, of the broadcast shape of both arguments."""
        ratio = np.asarray(slip, dtype=float) / self.slip_speed
        return np.asarray(-self.coefficient * np.asarray(pressing) * np.tanh(ratio))


@dataclass(frozen=True)
class Impulse:
    """Rigid contact: an impact returns ``e v`` at once (paper, eq. 4); a closed gap stays 0.

    `tangential` is the part of the slip speed that is returned, if friction suffices.
    """

    restitution: float
    tangential: float = 0.0

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Stored energy (J): always 0."""
        return np.zeros(np.shape(penetration))


PressingLaw = Penalty | Impulse
"""Law of a contact."""
