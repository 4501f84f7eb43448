"""The recorder of guide, link and levers: what is known of them at nodes and samples of steps.

Forces of drives, joints and slot at the samples, from Newton's law once the motion is known.

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
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.lagrangian.model import Model, Pivot, momentum_rate
from exudyn_flexlink.engines.lagrangian.system import Motion, System, joined
from exudyn_flexlink.engines.recording import AT_ONCE, ROWS, BlockRecorder, Kept, Steps, push_of
from exudyn_flexlink.engines.touching import ExtremeSeeker
from exudyn_flexlink.integrate.explicit import DenseStep
from exudyn_flexlink.integrate.radau import Step

Path = Step | DenseStep


class LinkKept(NamedTuple):
    """What is kept of the mechanism at instants (m,)."""

    poses: FloatArray  # (m, parts, 3)
    rates: FloatArray
    accelerations: FloatArray  # (m, N)
    momentum_rate: ComplexArray  # (m,) of the link, N
    motor: FloatArray  # (m,): torque of the speed drive, N m


class _Waiting(NamedTuple):
    t: float
    h: float
    motion: Motion  # at the nodes, then at samples


class Recorder(BlockRecorder):
    """Takes the steps of a system."""

    def __init__(self, system: System, grid: FloatArray, seeker: ExtremeSeeker) -> None:
        super().__init__(system.model.mechanism, grid, seeker, system.touches)
        self.system = system
        self._waiting: list[_Waiting] = []

    def due(self, step: Path) -> FloatArray:
        """Samples (n,), s, within a step."""
        return self._due(step.t + step.h)

    def begin(self, at: Motion) -> None:
        """Take the state (1,) at time 0."""
        self._start(self._known(at))

    def keep(self, at: Motion) -> None:
        """Keep a state (1,) as it is now, after what happened there."""
        self.work_off()
        self._keep_now(self._known(at))

    def take(self, step: Path, motion: Motion) -> None:
        """Take a step, known at its nodes and then at the samples that are `due` in it."""
        self._pass(step.t + step.h)
        self._waiting.append(_Waiting(step.t, step.h, motion))
        if len(self._waiting) >= AT_ONCE:
            self.work_off()

    def work_off(self) -> None:
        """Work off the steps that wait: the same contacts press in all of them."""
        if not self._waiting:
            return
        t, h, motions = (list(own) for own in zip(*self._waiting, strict=True))
        self._waiting.clear()
        counts = np.array([len(own.t) for own in motions])
        nodes = (np.cumsum(counts) - counts)[:, None] + ROWS
        samples = np.delete(np.arange(counts.sum()), nodes.ravel())
        of = np.repeat(np.arange(len(counts)), counts - len(ROWS))
        whole = joined(motions)
        known = self._known(whole)
        steps = Steps(np.array(t), np.array(h), nodes, samples, of)
        self._book(steps, known, self._rates(whole, known), known.pick(nodes[:, -1]))

    def _known(self, at: Motion) -> Kept:
        """What is known at instants, but for the totals."""
        model, count = self.system.model, len(at.t)
        a, held = self.system.accelerations(at)
        press = np.zeros((count, len(self.contacts)))
        if at.pushed is not None:
            press[:, at.pushed.which] = at.pushed.press
        press[:, self.system.held] = held
        motor = self.system.motor_torque(at, a, held)
        pressed = np.broadcast_to(self.touches.pressed, press.shape)
        places = (at.place + self.system.track.shift)[:, None]
        own = LinkKept(*model.poses(at.frame), a, momentum_rate(model.numbers, at.frame, a), motor)
        return Kept(at.t, places, press, pressed, np.zeros((count, 2)), own)

    def _rates(self, at: Motion, known: Kept) -> FloatArray:
        """Rates (m, ...) of the totals at instants."""
        count, v = len(self.contacts), at.frame.v
        rates = np.zeros((len(at.t), 2 + 2 * count))
        rates[:, 0] = ((v @ self.system.model.numbers.damping) * v).sum(axis=1)
        rates[:, 1] = known.own.motor * v[:, 0] + (at.motors * v).sum(axis=1)
        rates[:, 2 : 2 + count] = known.press
        if at.pushed is not None:
            rates[:, 2 + count + at.pushed.which] = at.pushed.power
        return rates

    def motion(self, at: Kept) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (m, parts, 3) at instants that are kept."""
        return at.own.poses, at.own.rates


@dataclass(frozen=True)
class Forces:
    """Reactions (samples, 2) in N, global axes, at instants that were `kept`."""

    model: Model
    kept: Kept

    @property
    def _own(self) -> LinkKept:
        own: LinkKept = self.kept.own
        return own

    def drive_torques(self) -> dict[str, FloatArray]:
        """Torque of each drive on its joint's second part, N m."""
        torques, layout = {}, self.model.layout
        if layout.motor is not None:
            torques[layout.motor.name] = layout.way * self._own.motor
        for torque, ramp in layout.torques:
            torques[torque.name] = ramp.values(self.kept.t)
        return torques

    @cached_property
    def _pushes(self) -> FloatArray:
        """Forces (contacts, samples, 2) on the link."""
        contacts, rods = self.model.contacts, self.model.layout.rods
        found = np.zeros((len(contacts), len(self.kept.t), 2))
        for k, contact in enumerate(contacts):
            rows = self.kept.press[:, k] != 0
            if not rows.any():
                continue
            at = self._own.poses[rows], self._own.rates[rows]
            push = push_of(contact, *at, self.kept.press[rows, k])
            found[k, rows] = push if contact.point.part in rods else -push
        return found

    @cached_property
    def _of_walls(self) -> FloatArray:
        return np.asarray(self._pushes[len(self.model.layout.faces) :].sum(axis=0))

    @cached_property
    def _on_link(self) -> FloatArray:
        """Contact forces and weight on the whole link."""
        numbers = self.model.numbers
        weight = np.array([numbers.gravity.real, numbers.gravity.imag])
        return np.asarray(numbers.masses.sum() * weight + self._pushes.sum(axis=0))

    @cached_property
    def slot(self) -> FloatArray:
        """Force of the track on P: all that the link lacks, or what it lacks along the guide."""
        lacking = _plane(self._own.momentum_rate) - self._on_link
        if self.model.layout.play:
            return np.asarray(lacking)
        normal = self.model.mechanism.slots[0].curve.normal(self.kept.places[:, 0])
        along = _plane(np.exp(1j * self._own.poses[:, self.model.layout.guide.part, 2]))
        left = np.sum(lacking * along, axis=1)
        return np.asarray((left / np.sum(normal * along, axis=1))[:, None] * normal)

    def joints(self) -> dict[str, FloatArray]:
        """Force of each pivot on its joint's second point."""
        layout = self.model.layout
        on_guide = _plane(self._own.momentum_rate) - self._on_link - self.slot + self._of_walls
        forces = {layout.guide.joint: self._pivot(layout.guide, on_guide)}
        for lever in layout.levers:
            pushes = np.zeros((len(self.kept.t), 2))
            for k, contact in enumerate(layout.faces):
                if contact.start.part == lever.part:
                    pushes += self._pushes[k]
            forces[lever.joint] = self._pivot(lever, pushes)
        return forces

    def _pivot(self, pivot: Pivot, given_on: FloatArray) -> FloatArray:
        """Force of a pivot whose part gives the force `given_on` on to others."""
        k, numbers = self.model.layout.coordinate(pivot.part), self.model.numbers
        a, mass = self._own.accelerations[:, k], self.model.mechanism.parts[pivot.part].mass
        angle, speed = (own[:, pivot.part, 2] for own in (self._own.poses, self._own.rates))
        swing = (1j * a - speed**2) * numbers.moments[k] * np.exp(1j * angle)
        force = _plane(swing - mass * numbers.gravity) + given_on
        return np.asarray(force if pivot.second else -force)


def _plane(vectors: ComplexArray) -> FloatArray:
    """Vectors x + i y (m,) as (m, 2)."""
    return np.stack([vectors.real, vectors.imag], axis=-1)
