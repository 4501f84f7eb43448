"""Forces of drives, joints and slot at the samples, from Newton's law once the motion is known.

With m a the momentum's rate of the whole link, F n the contact forces on it, g the weight's
acceleration, e along the guide and N the force of the track along its normal:

    along the guide:   m a.e = N (normal.e) + sum F n.e + m g.e    (the sleeve does not drag)
    across it:         S = m a - N normal - sum F n - m g          (of the sleeve, on the link)
    guide's pivot:     R = m_g a_g - m_g g + S
    a lever's pivot:   R = m_l a_l - m_l g + sum F n
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.layout import Pivot
from exudyn_flexlink.engines.lagrangian.model import Model
from exudyn_flexlink.engines.lagrangian.sampling import Motions
from exudyn_flexlink.engines.lagrangian.walls import wall_forces
from exudyn_flexlink.mechanism import approach


@dataclass(frozen=True)
class Forces:
    """Reactions (samples, 2) in N, global axes."""

    model: Model
    motion: Motions
    poses: FloatArray
    rates: FloatArray

    @cached_property
    def walls(self) -> tuple[FloatArray, FloatArray]:
        """Force and friction of the pairs of link and walls (samples, pairs, 2), sum on the link.

        Without pairs where there are no walls.
        """
        at = self.motion
        if not self.model.mechanism.channels:
            return np.zeros((len(at.q), 0, 2)), np.zeros((len(at.q), 2))
        return wall_forces(at.q, at.v, at.point, self.model.machine_constants)

    def drive_torques(self, time: FloatArray) -> dict[str, FloatArray]:
        """Torque of each drive on its joint's second part, N m."""
        torques = {}
        motor = self.model.layout.motor
        if motor is not None:
            torques[motor.name] = self.model.layout.way * self.motion.motor
        for torque, ramp in self.model.layout.torques:
            torques[torque.name] = ramp.values(time)
        return torques

    @cached_property
    def _on_link(self) -> FloatArray:
        """Contact forces and weight on the whole link."""
        constants = self.model.constants
        force = np.tile(constants.mass * constants.gravity, (len(self.motion.q), 1))
        for k in range(len(self.model.layout.faces)):
            force += self._push(k)
        return force + self.walls[1]

    def _push(self, k: int) -> FloatArray:
        """Force of contact k on the link's point."""
        contact = self.model.layout.faces[k]
        at, force = approach(contact, self.poses, self.rates), self.motion.forces[:, k]
        push = force[:, None] * at.normal
        if contact.friction is None:
            return np.asarray(push)
        return np.asarray(push + contact.friction.force(force, at.slip)[:, None] * at.along)

    @cached_property
    def _momentum_rate(self) -> FloatArray:
        q, v, a, point = self.motion[:4]
        c = self.model.constants
        p, rods = int(c.track_coordinate), c.rods.astype(int)
        rate = c.mass * (point[:, 2:4] * a[:, p, None] + point[:, 4:6] * v[:, p, None] ** 2)
        along, across = _axes(q[:, rods])
        swing = a[:, rods, None] * across - v[:, rods, None] ** 2 * along
        return np.asarray(rate + np.einsum("j,sjx->sx", c.firsts, swing))

    @cached_property
    def slot(self) -> FloatArray:
        """Force of the track on P: all that the link lacks, or what it lacks along the guide."""
        if self.model.layout.play:
            return np.asarray(self._momentum_rate - self._on_link)
        normal = self.model.mechanism.slots[0].curve.normal(self.motion.place)
        along, _ = _axes(self.motion.q[:, 0])
        left = np.sum((self._momentum_rate - self._on_link) * along, axis=1)
        return np.asarray((left / np.sum(normal * along, axis=1))[:, None] * normal)

    def joints(self) -> dict[str, FloatArray]:
        """Force of each pivot on its joint's second point."""
        layout = self.model.layout
        on_guide = self._momentum_rate - self._on_link - self.slot + self.walls[1]
        forces = {layout.guide.joint: self._pivot(layout.guide, 0, on_guide)}
        for lever in layout.levers:
            pushes = np.zeros((len(self.motion.q), 2))
            for k, contact in enumerate(self.model.layout.faces):
                if contact.start.part == lever.part:
                    pushes += self._push(k)
            forces[lever.joint] = self._pivot(lever, layout.coordinate(lever.part), pushes)
        return forces

    def _pivot(self, pivot: Pivot, coordinate: int, given_on: FloatArray) -> FloatArray:
        """Force of a pivot whose part gives the force `given_on` on to others."""
        q, v, a = self.motion[:3]
        c = self.model.constants
        mass = self.model.mechanism.parts[pivot.part].mass
        along, across = _axes(q[:, coordinate])
        x, y = c.moments[coordinate]
        arm, turned = x * along + y * across, x * across - y * along
        rate = a[:, coordinate, None] * turned - v[:, coordinate, None] ** 2 * arm
        force = rate - mass * c.gravity + given_on
        return np.asarray(force if pivot.second else -force)


def _axes(angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors e and e^ of angles, (..., 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)
