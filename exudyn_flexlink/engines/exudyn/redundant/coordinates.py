"""What the solver integrates, read as the mechanism's parts.

Exudyn's coordinates are those of its nodes, one after the other. Slots, contacts and records know
parts: x, y and angle of each. Where every part is a rigid body both are the same.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import (
    Assembly,
    Contact,
    EnergyMeter,
    Mechanism,
    accelerations,
    half_period,
    joint_residuals,
)

FloatArray = NDArray[np.float64]


class Coordinates(Protocol):
    """Coordinates q and velocities v of the solver: (instants, coordinates).

    `weights` (coordinates,) turn them into lengths: 1 for positions, a lever arm for angles.
    `mechanism` is that of the items: it has no rods where there are beams.
    """

    mechanism: Mechanism
    weights: FloatArray

    def start(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Coordinates, velocities and accelerations at time 0, (coordinates,)."""

    def jump(
        self, q: FloatArray, v: FloatArray, places: FloatArray, instants: tuple[float, float]
    ) -> FloatArray:
        """By how much accelerations (coordinates,) differ that drives make at two instants (s).

        Between them nothing else has changed: neither the state nor the slots' `places`.
        """

    def plain(self, q: list[float], v: list[float]) -> tuple[list[float], list[float]]:
        """Parts' coordinates and velocities, one after the other, as `at_joints`; one instant."""

    def at_joints(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (instants, parts, 3), right where joints and contacts take hold."""

    def shown(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (instants, parts, 3) of every part, for the Result."""

    def kinetic(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Kinetic energy, J, (instants,)."""

    def potential(self, q: FloatArray) -> FloatArray:
        """Energy of springs, beams and weight, J, (instants,)."""

    def damping_power(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Power lost in dampers, W, never negative, (instants,)."""

    def joint_errors(self, q: FloatArray, places: FloatArray) -> FloatArray:
        """Residuals of all joints, m or rad, (instants, joints), slots at their places."""

    def half_period(self, contact: Contact) -> float:
        """Half the period of a contact's stiffness with the least mass behind it, s."""


class PartCoordinates:
    """The coordinates are those of the parts."""

    def __init__(self, assembly: Assembly) -> None:
        self._assembly = assembly
        self.mechanism = assembly.mechanism
        self._meter = EnergyMeter(self.mechanism)
        parts = self.mechanism.parts
        self.weights = np.array([(1.0, 1.0, part.reach) for part in parts]).ravel()

    def start(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Those of the assembly."""
        state = self._assembly.state
        return state.q.ravel(), state.v.ravel(), state.a.ravel()

    def jump(
        self, q: FloatArray, v: FloatArray, places: FloatArray, instants: tuple[float, float]
    ) -> FloatArray:
        """Difference of the parts' accelerations: whatever contacts do to them cancels."""
        moved = (accelerations(self.mechanism, _parts(q), _parts(v), places, t) for t in instants)
        before, after = moved
        return (after - before).ravel()

    def plain(self, q: list[float], v: list[float]) -> tuple[list[float], list[float]]:
        """Return them as they are."""
        return q, v

    def at_joints(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return them as they are, three to a part."""
        return _parts(q), _parts(v)

    def shown(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return them as they are, three to a part."""
        return _parts(q), _parts(v)

    def kinetic(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Kinetic energy of the parts."""
        return self._meter.kinetic(_parts(q), _parts(v))

    def potential(self, q: FloatArray) -> FloatArray:
        """Energy of springs and weight."""
        return self._meter.potential(_parts(q))

    def damping_power(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Power lost in the dampers of hinges and springs."""
        return self._meter.damping_power(_parts(q), _parts(v))

    def joint_errors(self, q: FloatArray, places: FloatArray) -> FloatArray:
        """Residuals of all joints."""
        return joint_residuals(self.mechanism, _parts(q), places)

    def half_period(self, contact: Contact) -> float:
        """With the least mass that the parts oppose."""
        return half_period(self._assembly, contact)


def _parts(x: FloatArray) -> FloatArray:
    return x.reshape(*x.shape[:-1], -1, 3)
