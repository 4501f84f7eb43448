"""From a tree's run to a Result: poses, reactions, events, checks."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.intervals import Written
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Motions, motions
from exudyn_flexlink.engines.exudyn.minimal.loop import MinimalLoop
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.reactions import reactions_of
from exudyn_flexlink.engines.exudyn.minimal.recording import Recorder
from exudyn_flexlink.engines.exudyn.reporting import Report
from exudyn_flexlink.mechanism import approach
from exudyn_flexlink.result import Checks, ContactHistory, EnergyHistory, Event
from exudyn_flexlink.scene import Scene

FloatArray = NDArray[np.float64]


@dataclass
class MinimalRun:
    """A run of a tree, before and after it is made."""

    scene: Scene
    model: MinimalModel
    loop: MinimalLoop
    recorder: Recorder
    events: list[Event]


def report(run: MinimalRun) -> Report:
    """Everything of the run that a Result shows."""
    return _Reading(run).report()


class _Reading:
    def __init__(self, run: MinimalRun) -> None:
        self.run = run
        self.model, self.mechanism = run.model, run.model.assembly.mechanism
        recorder = run.recorder
        samples = recorder.samples
        self.time, self.x, self.v = (
            np.array([getattr(sample, name) for sample in samples]) for name in ("time", "x", "v")
        )
        self.slots = {slot.name for slot in self.mechanism.slots}
        self.places = np.array([s.places for s in samples]).reshape(len(samples), -1)
        contacts = len(self.mechanism.contacts)
        self.pressed = np.array(
            [s.pressed or (False,) * contacts for s in samples], dtype=bool
        ).reshape(len(samples), -1)
        self.a, self.left, self.totals = (
            np.concatenate(rows)
            for rows in (recorder.accelerations, recorder.left, recorder.totals)
        )
        model = self.model
        self.moved: Motions = motions(model.layout, model.kinematics, self.x, self.v, self.a)
        self.approaches = [
            approach(contact, self.moved.poses, self.moved.rates)
            for contact in self.mechanism.contacts
        ]
        self.pressing = np.zeros(self.pressed.shape)
        for k, at in enumerate(self.approaches):
            law = self.model.contacts[k].law
            self.pressing[:, k] = self.pressed[:, k] * law.force(-at.gap, -at.gap_rate)
        self.reactions = reactions_of(model, self.time, self.x, self.places, self.left)

    def report(self) -> Report:
        poses, rates = self.moved.poses, self.moved.rates
        energies = self.run.recorder.energies(poses, rates, self.totals, self.pressed)
        contacts, written = {}, self._written()
        for k, contact in enumerate(self.mechanism.contacts):
            at, force = self.approaches[k], self.pressing[:, k]
            touches = written.intervals(k)
            contacts[contact.name] = ContactHistory(at.gap, at.place, force, touches)
        return Report(
            settings=self._settings(),
            time=self.time,
            poses=poses,
            rates=rates,
            drive_torques=self._torques(),
            joint_forces=self._joint_forces(),
            slot_forces={s.name: self.reactions.forces[s.name] for s in self.mechanism.slots},
            contacts=contacts,
            sleeves={},
            energy=EnergyHistory(*energies.T),
            extremes=self.run.recorder.seeker.extremes(),
            laps=tuple(lap for lap in self.run.events if lap.time < self.run.loop.end),
            checks=self._checks(),
        )

    def _written(self) -> Written:
        loop, recorder, contacts = self.run.loop, self.run.recorder, self.model.contacts
        noted = zip(loop.entries, recorder.at_notes, strict=True)
        return Written(
            loop.entries,
            [recorder.totals_of(entry.index, at) for entry, at in noted],
            recorder.totals_of,
            lambda k: contacts[k].peak,
            recorder.seeker,
        )

    def _settings(self) -> dict[str, float | str]:
        accuracy = self.run.scene.accuracy
        settings: dict[str, float | str] = {
            "formulation": "minimal",
            "integrator": "Radau IIA of order 9",
        }
        if accuracy.step is not None:
            settings["step"] = accuracy.step
        if accuracy.tolerance is not None:
            settings["tolerance"] = accuracy.tolerance
        return settings

    def _checks(self) -> Checks:
        loop, recorder = self.run.loop, self.run.recorder
        return Checks(
            energy_residual=recorder.energy_residual,
            largest_kinetic_energy=recorder.largest_kinetic_energy,
            constraint_error=recorder.constraint_error,
            steps=loop.steps,
            newton_iterations=loop.iterations,
            smallest_step=loop.smallest_step if isfinite(loop.smallest_step) else 0.0,
            largest_step=loop.largest_step,
            steps_per_contact=inf,  # the error is controlled there as everywhere
            largest_penetration=float(recorder.seeker.deepest.max(initial=0.0)),
        )

    # --- reactions ----------------------------------------------------------------------------

    def _torques(self) -> dict[str, FloatArray]:
        """Torque of each drive on its joint's second part, N m."""
        torques = dict(self.reactions.torques)
        for motor, _ in self.model.torques:
            torques[motor.name] = np.array([motor.ramp.at(t) for t in self.time])
        return torques

    def _joint_forces(self) -> dict[str, FloatArray]:
        """Force of each hinge on its second point: Newton's law for all that hangs on it."""
        layout = self.model.layout
        given = self._given()
        forces = {}
        for name in self.run.scene.joints:
            if name in layout.pins:
                link, second = layout.pins[name]
                held = [
                    part for part, own in layout.frames.items() if link in layout.path(own.link)
                ]
                force = sum((self._momentum_rate(part) - given[part] for part in held),
                            np.zeros((len(self.time), 2)))  # fmt: skip
                forces[name] = force if second else -force
            elif name in self.reactions.forces and name not in self.slots:
                forces[name] = self.reactions.forces[name]
        return forces

    def _momentum_rate(self, part: int) -> FloatArray:
        """Mass times acceleration of a part's centre, less its weight, N."""
        body = self.mechanism.parts[part]
        x, y = body.centre
        pose, rate, bend = (
            m[:, part] for m in (self.moved.poses, self.moved.rates, self.moved.bends)
        )
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        arm = np.stack([c * x - s * y, s * x + c * y], axis=-1)
        turned = np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
        acceleration = bend[:, :2] + bend[:, 2:] * turned - rate[:, 2:] ** 2 * arm
        return np.asarray(body.mass * (acceleration - np.asarray(self.mechanism.gravity)))

    def _given(self) -> list[FloatArray]:
        """Forces of slots, closed loops and contacts on each part, N."""
        given = [np.zeros((len(self.time), 2)) for _ in self.mechanism.parts]
        for part, force in self.reactions.on_parts:
            if part >= 0:
                given[part] += force
        for k, contact in enumerate(self.mechanism.contacts):
            at = self.approaches[k]
            push = self.pressing[:, k, None] * at.normal
            if contact.friction is not None:
                rub = contact.friction.force(self.pressing[:, k], at.place_rate)
                along = contact.side * np.stack([at.normal[:, 1], -at.normal[:, 0]], axis=-1)
                push = push + rub[:, None] * along
            if contact.point.part >= 0:
                given[contact.point.part] += push
            if contact.start.part >= 0:
                given[contact.start.part] -= push
        return given
