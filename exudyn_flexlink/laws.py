"""Contact laws: the force of a penalty contact with restitution, and restitution by impulse.

No contact history is kept: force and energies follow from the penetration ``d`` (m, positive
inside) and its rate ``d'`` (m/s, positive while approaching) of this instant alone. That parameters
are within their ranges is checked where they are read, in the scene.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink.arrays import FloatArray


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

    def force(self, penetration: ArrayLike, rate: ArrayLike) -> FloatArray:
        """Pressing force in N (never negative), of the broadcast shape of both arguments.

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
class SpringDamper:
    """Spring with a damper that acts on one side and lets go before it would pull (Kelvin-Voigt).

    ``F = F_0 + k d + c d'`` while ``d > 0`` and ``F > 0``, else 0: a touch ends where its force
    does (T. Schwager and T. Poeschel, Granular Matter 9 (2007) 465). Without ``F_0``, and with
    ``z = c/(2 sqrt(k m)) < 1``, an impact returns ``exp(-2 z arccos(z)/sqrt(1 - z^2))`` of the
    speed. What the spring still holds where it lets go is lost.

    Parameters are ``stiffness`` k (N/m, > 0), ``damping`` c (N s/m) and ``preload`` F_0 (N); of
    what turns N m/rad, N m s/rad and N m.
    """

    stiffness: float
    damping: float = 0.0
    preload: float = 0.0

    def force(self, penetration: ArrayLike, rate: ArrayLike) -> FloatArray:
        """Pressing force in N (never negative), of the broadcast shape of both arguments."""
        d = np.asarray(penetration)
        held = self.preload + self.stiffness * d + self.damping * np.asarray(rate)
        return np.where(d > 0, np.maximum(held, 0.0), 0.0)

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy F_0 d + k d^2/2 in J."""
        d = np.maximum(penetration, 0.0)
        return np.asarray(self.preload * d + 0.5 * self.stiffness * d**2)

    def half_period(self, mass: float) -> float:
        """Half a period pi sqrt(m/k) in s of ``mass`` (kg), without the damper."""
        return math.pi * math.sqrt(mass / self.stiffness)


@dataclass(frozen=True)
class SpringTable:
    """As `SpringDamper`, with a force that is straight between rows: `forces` (N) at `depths` (m).

    `depths` begin at 0 and increase; the table ends at the last one.
    """

    depths: tuple[float, ...]
    forces: tuple[float, ...]
    damping: float = 0.0

    def piece(self, number: int) -> SpringDamper:
        """Law between two rows, which goes on straight beyond them."""
        (d, after), (force, next_force) = (
            own[number : number + 2] for own in (self.depths, self.forces)
        )
        slope = (next_force - force) / (after - d)
        return SpringDamper(slope, self.damping, force - slope * d)

    def number(self, penetration: float) -> int:
        """Number of the piece that a penetration (m) is in."""
        return min(max(bisect_right(self.depths, penetration) - 1, 0), len(self.depths) - 2)

    def force(self, penetration: ArrayLike, rate: ArrayLike) -> FloatArray:
        """Pressing force in N (never negative), of the broadcast shape of both arguments."""
        d, rate = np.broadcast_arrays(penetration, rate)
        held = np.interp(d, self.depths, self.forces) + self.damping * rate
        return np.where(d > 0, np.maximum(held, 0.0), 0.0)

    def stored_energy(self, penetration: ArrayLike) -> FloatArray:
        """Energy in J: the area below the table."""
        d = np.maximum(penetration, 0.0)
        areas = np.diff(self.depths) * (np.array(self.forces[1:]) + self.forces[:-1]) / 2
        k = np.clip(np.searchsorted(self.depths, d, side="right") - 1, 0, len(areas) - 1)
        begin, force = np.take(self.depths, k), np.interp(d, self.depths, self.forces)
        before = np.concatenate([[0.0], np.cumsum(areas)])[k]
        return np.asarray(before + (d - begin) * (np.take(self.forces, k) + force) / 2)

    def half_period(self, mass: float) -> float:
        """Half a period in s of ``mass`` (kg) on the steepest piece."""
        slopes = np.abs(np.diff(self.forces) / np.diff(self.depths))
        steepest = max(float(slopes.max()), max(self.forces) / self.depths[-1])
        return math.pi * math.sqrt(mass / steepest)


OneSided = SpringDamper | SpringTable
"""What lets go before it would pull."""


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
    """Rigid contact: an impact returns ``e v`` at once (paper, eq. 4); pushing leaves no gap.

    `tangential` is the part of the slip's speed that comes back, if friction is enough for that.
    """

    restitution: float
    tangential: float = 0.0


PressingLaw = RestitutionPenalty | OneSided | Impulse
"""Law of a contact of the scene."""
