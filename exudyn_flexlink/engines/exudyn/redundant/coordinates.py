"""What the solver integrates, read as the mechanism's parts.

Exudyn's coordinates are those of its nodes, one after the other. Slots, contacts and records know
parts: x, y and angle of each. Where every part is a rigid body both are the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Assembly, Channel, Contact, accelerations, half_period


class OfBeams(NamedTuple):
    """Kinetic energy and energy stored in beams (instants,), J, and the power they lose, W."""

    kinetic: FloatArray
    stored: FloatArray
    lost: FloatArray


class Coordinates:
    """Coordinates q and velocities v of the solver, (instants, coordinates): here the parts' own.

    `weights` (coordinates,) turn them into lengths: 1 for positions, a lever arm for angles.
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.mechanism = assembly.mechanism
        self.weights = np.array([(1, 1, part.reach) for part in self.mechanism.parts]).ravel()

    def start(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Coordinates, velocities and accelerations at time 0, (coordinates,)."""
        state = self.assembly.state
        return state.q.ravel(), state.v.ravel(), state.a.ravel()

    def accelerations(
        self, q: FloatArray, v: FloatArray, places: FloatArray, time: float
    ) -> FloatArray:
        """Accelerations (coordinates,) at slots' `places` and a time (s), without contacts."""
        return accelerations(self.mechanism, _parts(q), _parts(v), places, time).ravel()

    def plain(self, q: list[float], v: list[float]) -> tuple[list[float], list[float]]:
        """Parts' coordinates and velocities, one after the other, as `at_joints`; one instant."""
        return q, v

    def at_joints(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (instants, parts, 3), right where joints and contacts take hold."""
        return _parts(q), _parts(v)

    def shown(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (instants, parts, 3) of every part, for the Result."""
        return self.at_joints(q, v)

    def of_beams(self, q: FloatArray, v: FloatArray) -> OfBeams:  # noqa: ARG002
        """What beams have beside what rigid parts and springs do: here there are none."""
        return OfBeams(*np.zeros((3, len(q))))

    def half_period(self, contact: Contact | Channel) -> float:
        """Half the period of a contact's stiffness with the least mass behind it, s."""
        return half_period(self.assembly, contact)


def _parts(x: FloatArray) -> FloatArray:
    return x.reshape(*x.shape[:-1], -1, 3)
