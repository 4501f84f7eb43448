"""The solver's coordinates, converted to those of the mechanism's parts.

Exudyn's coordinates are those of its nodes in a row. Slots, contacts and records use parts, with x,
y and angle of each. If all parts are rigid bodies, both are the same.

Joints and contacts act on a beam at its two ends only. The two end rods of a beam stand for it: the
first is at the beam's start, along its slope; the last ends at the beam's end and lies along the
x-axis, since its direction is not used.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn.redundant.beam import BeamLink, cross, straight
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import (
    Assembly,
    Channel,
    Contact,
    accelerations,
    anchor_jacobian,
    applied_forces,
    constraints_at,
    demanded_accelerations,
    half_period,
    mass_blocks,
)
from exudyn_flexlink.rounding import INVISIBLE, ROUNDING, TINY


class OfBeams(NamedTuple):
    """Kinetic energy and energy stored in beams (instants,), J, and the power they lose, W."""

    kinetic: FloatArray
    stored: FloatArray
    lost: FloatArray


class Coordinates:
    """Coordinates q and velocities v of the solver, (instants, coordinates): those of the parts.

    `weights` (coordinates,) turn coordinates into lengths: 1 for positions, a lever arm for angles.
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
        """Parts' coordinates and velocities in a row, as `at_joints`, for one instant."""
        return q, v

    def at_joints(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (instants, parts, 3), exact at the points of joints and contacts."""
        return _parts(q), _parts(v)

    def shown(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (instants, parts, 3) of every part, for the Result."""
        return self.at_joints(q, v)

    def of_beams(self, q: FloatArray, v: FloatArray) -> OfBeams:  # noqa: ARG002
        """Energies of beams, besides those of rigid parts and springs: 0 without beams."""
        return OfBeams(*np.zeros((3, len(q))))

    def half_period(self, contact: Contact | Channel) -> float:
        """Half the period of a contact's stiffness with the least mass behind it, s."""
        return half_period(self.assembly, contact)


@dataclass(frozen=True)
class _BeamColumns:
    """A beam, its columns among all coordinates, and the matrix to the ends of its rods."""

    link: BeamLink
    first: int
    to_joints: FloatArray

    @property
    def columns(self) -> slice:
        return slice(self.first, self.first + 2 * self.link.shape.count)

    def controls(self, x: FloatArray) -> FloatArray:
        """Positions and slopes of the nodes, or their rates: (..., controls, 2)."""
        return x[..., self.columns].reshape(*x.shape[:-1], -1, 2)


class BeamCoordinates(Coordinates):
    """Coordinates of rigid parts and of beams' nodes; the beams' rods have no mass."""

    def __init__(self, assembly: Assembly, beams: tuple[BeamLink, ...]) -> None:
        super().__init__(assembly)
        self._gravity = np.asarray(self.mechanism.gravity)
        self._beams: list[_BeamColumns] = []
        self._rigid: list[tuple[int, int]] = []  # part, first coordinate
        self._lay_out(beams)
        _refuse_bent(assembly.state.q, assembly.state.v, beams)
        self._q, self._v = self._straight()

    def _lay_out(self, beams: tuple[BeamLink, ...]) -> None:
        starts = {beam.rods[0]: beam for beam in beams}
        inside = {rod for beam in beams for rod in beam.rods}
        first = 0
        weights: list[float] = []
        for i, part in enumerate(self.mechanism.parts):
            if i in starts:
                shape = starts[i].shape
                places = np.cumsum([0.0, *starts[i].lengths])
                self._beams.append(_BeamColumns(starts[i], first, shape.rows(places)))
                weights += [1.0, 1.0, shape.element, shape.element] * (shape.count // 2)
            elif i not in inside:
                self._rigid.append((i, first))
                weights += [1.0, 1.0, part.reach]
            first = len(weights)
        self.weights = np.array(weights)

    # --- at time 0 -------------------------------------------------------------------------------

    def start(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Straight beams that move as their rods, and accelerations that joints allow."""
        places = self.assembly.state.places
        return self._q, self._v, self.accelerations(self._q, self._v, places, 0.0)

    def _straight(self) -> tuple[FloatArray, FloatArray]:
        q, v = np.zeros(len(self.weights)), np.zeros(len(self.weights))
        for part, first in self._rigid:
            q[first : first + 3], v[first : first + 3] = (
                self.assembly.state.q[part],
                self.assembly.state.v[part],
            )
        for beam in self._beams:
            for x, controls in zip((q, v), straight(beam.link, self.assembly.state), strict=True):
                x[beam.columns] = controls.ravel()
        return q, v

    def accelerations(
        self, q: FloatArray, v: FloatArray, places: FloatArray, time: float
    ) -> FloatArray:
        """Accelerations without elastic forces of beams: these are 0 at time 0 and never jump."""
        poses, rates = self._at_state(q, v)
        spread = self._spread(q)
        forces = spread.T @ applied_forces(self.mechanism, poses, rates, time)
        for beam in self._beams:
            shape = beam.link.shape
            weight = shape.elastic.mass * np.outer(shape.weight_rows(), self._gravity)
            forces[beam.columns] += weight.ravel()
        right = demanded_accelerations(
            self.mechanism, lambda at: self._joints(at, places) @ v, q, v, time
        )
        by_forces, by_joints = self._moving(q, places)
        return np.asarray(by_forces @ forces + by_joints @ right)

    def _moving(self, q: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Matrices from forces, and from demands of joints, to accelerations.

        These are the nearest to accelerations without joints, measured by the mass. Joints may be
        redundant.
        """
        mass, joints = self._mass(q), self._joints(q, places)
        arms = np.linalg.solve(mass, joints.T)
        sizes = np.sqrt(np.maximum(np.sum(joints.T * arms, axis=0), TINY))
        unit = arms / sizes
        inverse = np.linalg.pinv(joints @ unit / sizes[:, None], rcond=ROUNDING, hermitian=True)
        return np.linalg.inv(mass) - unit @ inverse @ unit.T, unit @ inverse / sizes

    def _joints(self, q: FloatArray, places: FloatArray) -> FloatArray:
        """Jacobian of all joints and motors, (rows, coordinates)."""
        poses, _ = self._at_state(q, q)
        joints = constraints_at(self.mechanism, poses, places)
        return joints.jacobian() @ self._spread(q)

    def _mass(self, q: FloatArray) -> FloatArray:
        poses, _ = self._at_state(q, q)
        spread = self._spread(q)
        rows = spread.reshape(-1, 3, len(q))
        mass = np.einsum("pik,pij,pjl->kl", rows, mass_blocks(self.mechanism, poses), rows)
        for beam in self._beams:
            mass[beam.columns, beam.columns] += np.kron(beam.link.shape.mass, np.eye(2))
        return np.asarray(mass)

    def _spread(self, q: FloatArray) -> FloatArray:
        """Derivative of `at_joints` by the coordinates, (3 parts, coordinates)."""
        spread = np.zeros((3 * len(self.mechanism.parts), len(q)))
        for part, first in self._rigid:
            spread[3 * part : 3 * part + 3, first : first + 3] = np.eye(3)
        for beam in self._beams:
            start, end = 3 * beam.link.rods[0], 3 * beam.link.rods[-1]
            first, last = beam.first, beam.columns.stop - 4
            sx, sy = q[first + 2], q[first + 3]
            spread[start : start + 2, first : first + 2] = np.eye(2)
            spread[start + 2, first + 2 : first + 4] = np.array([-sy, sx]) / (sx**2 + sy**2)
            spread[end : end + 2, last : last + 2] = np.eye(2)
        return spread

    def half_period(self, contact: Contact | Channel) -> float:
        """As for rigid parts, with the mass that a beam's end opposes at time 0."""
        assert not isinstance(contact.law, Impulse)  # refused
        poses, spread = self._at_state(self._q, self._v)[0], self._spread(self._q)
        moving, _ = self._moving(self._q, self.assembly.state.places)
        first, second = (
            max(_mobility(moving, anchor_jacobian(anchor, poses) @ spread) for anchor in anchors)
            for anchors in contact.anchors
        )
        return contact.law.half_period(1.0 / max(first + second, TINY))

    # --- as parts --------------------------------------------------------------------------------

    def plain(self, q: list[float], v: list[float]) -> tuple[list[float], list[float]]:
        """Parts' coordinates as `at_joints`, but with angles 0 of beams' rods."""
        count = 3 * len(self.mechanism.parts)
        poses, rates = [0.0] * count, [0.0] * count
        for part, first in self._rigid:
            poses[3 * part : 3 * part + 3] = q[first : first + 3]
            rates[3 * part : 3 * part + 3] = v[first : first + 3]
        for beam in self._beams:
            start, end = 3 * beam.link.rods[0], 3 * beam.link.rods[-1]
            first, last = beam.first, beam.columns.stop - 4
            poses[start : start + 2], rates[start : start + 2] = (
                q[first : first + 2],
                v[first : first + 2],
            )
            poses[end], poses[end + 1] = q[last] - beam.link.lengths[-1], q[last + 1]
            rates[end], rates[end + 1] = v[last], v[last + 1]
        return poses, rates

    def _at_state(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        poses, rates = self.at_joints(q[None], v[None])
        return poses[0], rates[0]

    def at_joints(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses and rates; end rods of a beam are at its ends, all others at 0."""
        poses, rates = self._rigid_parts(q, v)
        for beam in self._beams:
            placed, moved = beam.controls(q), beam.controls(v)
            start, end = beam.link.rods[0], beam.link.rods[-1]
            poses[:, start, :2], rates[:, start, :2] = placed[:, 0], moved[:, 0]
            poses[:, start, 2] = _angle(placed[:, 1], poses[:, beam.link.guide, 2])
            rates[:, start, 2] = cross(placed[:, 1], moved[:, 1]) / np.sum(
                placed[:, 1] ** 2, axis=-1
            )
            poses[:, end, :2] = placed[:, -2] - (beam.link.lengths[-1], 0.0)
            rates[:, end, :2] = moved[:, -2]
        return poses, rates

    def shown(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses and rates; each rod of a beam is a chord. The ends of the beam are exact.

        A chord is shorter than its rod: by less than a part phi^2/24 of the length, if the rod
        bends by the angle phi.
        """
        poses, rates = self._rigid_parts(q, v)
        for beam in self._beams:
            points = beam.to_joints @ beam.controls(q)
            moved = beam.to_joints @ beam.controls(v)
            chords, turned = np.diff(points, axis=1), np.diff(moved, axis=1)
            speeds = cross(chords, turned) / np.sum(chords**2, axis=-1)
            near = poses[:, beam.link.guide, 2]
            for k, rod in enumerate(beam.link.rods):
                near = _angle(chords[:, k], near)
                poses[:, rod, :2], poses[:, rod, 2] = points[:, k], near
                rates[:, rod, :2], rates[:, rod, 2] = moved[:, k], speeds[:, k]
            # The last rod ends at the beam's end, which is the point that strikes.
            last, length = beam.link.rods[-1], beam.link.lengths[-1]
            arm = length * np.stack([np.cos(near), np.sin(near)], axis=-1)
            poses[:, last, :2] = points[:, -1] - arm
            turning = speeds[:, -1:] * np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
            rates[:, last, :2] = moved[:, -1] - turning
        return poses, rates

    def _rigid_parts(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        shape = (len(q), len(self.mechanism.parts), 3)
        poses, rates = np.zeros(shape), np.zeros(shape)
        for part, first in self._rigid:
            poses[:, part], rates[:, part] = q[:, first : first + 3], v[:, first : first + 3]
        return poses, rates

    # --- energies --------------------------------------------------------------------------------

    def of_beams(self, q: FloatArray, v: FloatArray) -> OfBeams:
        """Energies of beams, besides those of rigid parts and springs."""
        beams = super().of_beams(q, v)
        for beam in self._beams:
            shape, controls, moved = beam.link.shape, beam.controls(q), beam.controls(v)
            weight = shape.elastic.mass * shape.weight_rows() @ controls @ self._gravity
            beams.kinetic[:] += shape.kinetic(moved)
            beams.stored[:] += shape.stored(controls) - weight
            beams.lost[:] += shape.damping_power(controls, moved)
        return beams


def _mobility(moving: FloatArray, rows: FloatArray) -> float:
    """Largest acceleration by a unit force at a point (1/kg), with rows (2, coordinates)."""
    return float(np.linalg.eigvalsh(rows @ moving @ rows.T).max())


def _angle(along: FloatArray, near: FloatArray) -> FloatArray:
    """Angle (instants,) of directions (instants, 2), within half a turn of `near`."""
    c, s = np.cos(near), np.sin(near)
    turned = np.arctan2(c * along[:, 1] - s * along[:, 0], c * along[:, 0] + s * along[:, 1])
    return np.asarray(near + turned)


def _refuse_bent(q: FloatArray, v: FloatArray, beams: tuple[BeamLink, ...]) -> None:
    for beam in beams:
        rods = list(beam.rods)
        if np.ptp(q[rods, 2]) > INVISIBLE or np.ptp(v[rods, 2]) > INVISIBLE:
            raise NotRepresentableError(
                ("bodies", beam.body), "a beam starts straight, and turns as a whole"
            )


def _parts(x: FloatArray) -> FloatArray:
    return x.reshape(*x.shape[:-1], -1, 3)
