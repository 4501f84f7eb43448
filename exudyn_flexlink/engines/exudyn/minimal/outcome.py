"""From a tree's run to a Result: poses, reactions, events, checks."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Event as Asked

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.ending import checks
from exudyn_flexlink.engines.exudyn.histories import Histories, push_of
from exudyn_flexlink.engines.exudyn.intervals import Written
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Motions, motions
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.problem import MinimalProblem
from exudyn_flexlink.engines.exudyn.minimal.reactions import reactions_of
from exudyn_flexlink.engines.exudyn.minimal.recording import Recorder
from exudyn_flexlink.engines.exudyn.reporting import versions
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.integrate.stepper import ImplicitStepper
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import (
    GROUND,
    Contact,
    approach,
    force_at,
    left_of,
    line_of,
    sizes_at,
    spring_force,
    turned,
)
from exudyn_flexlink.mechanism.tree import hanging_on
from exudyn_flexlink.result import EnergyHistory, Event, Outcome, Result
from exudyn_flexlink.scene import PointsJoint, Scene


@dataclass
class MinimalRun:
    """A run of a tree, before and after it is made."""

    scene: Scene
    model: MinimalModel
    problem: MinimalProblem
    stepper: ImplicitStepper
    solution: Solution
    asked: Asked  # whether the user asked to stop
    recorder: Recorder
    events: list[Event]


class RunReader:
    """Reads what a run recorded, and puts its Result together."""

    def __init__(self, run: MinimalRun) -> None:
        self.run = run
        self.model, self.mechanism = run.model, run.model.assembly.mechanism
        recorder = run.recorder
        samples = recorder.samples.kept
        self.time, self.x, self.v = (
            np.array([getattr(sample, name) for sample in samples]) for name in ("time", "x", "v")
        )
        self.places = np.array([s.places for s in samples]).reshape(len(samples), -1)
        self.pressed = np.array([s.pressed for s in samples])
        self.a, self.constraint_forces, self.totals = (
            np.concatenate(rows)
            for rows in (
                recorder.samples.accelerations,
                recorder.samples.constraint_forces,
                recorder.totals,
            )
        )
        model = self.model
        self.moved: Motions = motions(model.layout, model.kinematics, self.x, self.v, self.a)
        self.pulls = {
            spring: spring_force(spring, self.moved.poses, self.moved.rates)
            for spring in self.mechanism.linear_springs
        }
        self.pressing = np.zeros(self.pressed.shape)
        self.on_points = self._pressing()
        self.histories = Histories(
            self.mechanism, self.moved.poses, self.moved.rates, self.pressing, self._written()
        )
        self.forces = {
            force.name: force_at(force, self.time, self.moved.poses, self.moved.rates)
            for force in self.mechanism.forces
        }
        self.force_parts = {
            force.name: (force.point.part, GROUND) for force in self.mechanism.forces
        }
        self.reactions = reactions_of(model, self.x, self.places, self.constraint_forces)
        for motor in self.mechanism.speed_motors:
            if motor.slide:
                line = line_of(motor.slide, self.moved.poses)
                self.forces[motor.name] = self.reactions.torques.pop(motor.name)[:, None] * line
                self.force_parts[motor.name] = motor.second, motor.first

    def _pressing(self) -> list[tuple[Contact, FloatArray]]:
        """Fill in the forces of contacts; return those (samples, 2) on the first parts, N."""
        found = []
        for k in np.flatnonzero(self.pressed.any(axis=0)).tolist():
            contact, rows = self.run.recorder.contacts[k], self.pressed[:, k]
            at = approach(contact, self.moved.poses[rows], self.moved.rates[rows])
            if isinstance(contact.law, Impulse):
                press = np.array([s.forces[k] for s in self.run.recorder.samples.kept])[rows]
            else:
                press = contact.law.force(-at.gap, -at.gap_rate)
            self.pressing[rows, k] = press
            push = np.zeros((len(rows), 2))
            push[rows] = push_of(contact, self.moved.poses[rows], self.moved.rates[rows], press)
            found.append((contact, push))
        return found

    def result(self, warnings: tuple[str, ...], outcome: Outcome) -> Result:
        """Return the Result; its timings are still to come."""
        poses, rates = self.moved.poses, self.moved.rates
        recorder, problem = self.run.recorder, self.run.problem
        growing, scattered = problem.instability, problem.scattering.e_folds(self.run.stepper.time)
        energies = recorder.energies(poses, rates, self.totals, self.pressed)
        return Result(
            scene=self.run.scene,
            engine="exudyn",
            settings=self._settings(),
            versions=versions(),
            timings={},
            part_names=tuple(part.name for part in self.mechanism.parts),
            time=self.time,
            poses=poses,
            rates=rates,
            drive_torques=self._torques(),
            drive_forces=self.forces,
            joint_forces=self._joint_forces(),
            slot_forces={s.name: self.reactions.forces[s.name] for s in self.mechanism.slots},
            spring_forces={
                spring.name: force
                for spring, force in self.pulls.items()
                if spring.name in self.run.scene.springs
            },
            contacts=self.histories.contacts(),
            bearings=self.histories.bearings(),
            sleeves=self.histories.sleeves(),
            energy=EnergyHistory(*energies.T),
            extremes=recorder.seeker.extremes(),
            laps=tuple(lap for lap in self.run.events if lap.time < self.run.problem.end),
            checks=checks(
                self.run.stepper,
                recorder,
                float(recorder.seeker.deepest.max(initial=0.0)),
                growing.e_folds + scattered,
                growing.ringing(self.run.stepper.time, self.run.stepper.steps),
            ),
            warnings=warnings,
            outcome=outcome,
        )

    def _written(self) -> Written:
        recorder = self.run.recorder
        noted = zip(recorder.entries, recorder.at_notes, strict=True)
        count = len(recorder.contacts)
        peaks = [contact.peak for contact in self.model.contacts]
        return Written(
            recorder.entries,
            [recorder.totals_of(entry.index, at) for entry, at in noted],
            [recorder.totals_of(k) for k in range(count)],
            [*peaks, *[0.0] * (count - len(peaks))],  # of walls the seeker knows it
            recorder.seeker,
            recorder.impacts,
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
            settings["tolerance"] = self.run.stepper.control.tolerance
        return settings

    # --- reactions ----------------------------------------------------------------------------

    def _torques(self) -> dict[str, FloatArray]:
        """Torque of each drive that has one on its joint's second part, N m."""
        torques = dict(self.reactions.torques)
        state = self.time, self.moved.poses, self.moved.rates
        for motor in self.mechanism.torque_motors:
            torques[motor.name] = sizes_at(motor.size, *state)
        return torques

    def _joint_forces(self) -> dict[str, FloatArray]:
        """Force of each joint on its second point: Newton's law for all that hangs on it."""
        given = self._given()
        forces = {}
        for name, joint in self.run.scene.joints.items():
            if not isinstance(joint, PointsJoint):
                continue
            hanging = hanging_on(self.mechanism, self.model.layout, name)
            if hanging is not None:
                held, sign = hanging
                force = sum((self._momentum_rate(part) - given[part] for part in held),
                            np.zeros((len(self.time), 2)))  # fmt: skip
                forces[name] = sign * force
            elif name in self.reactions.forces:
                forces[name] = self.reactions.forces[name]
        return forces | self.histories.bearing_forces()

    def _momentum_rate(self, part: int) -> FloatArray:
        """Mass times acceleration of a part's centre, less its weight, N."""
        body = self.mechanism.parts[part]
        pose, rate, bend = (
            m[:, part] for m in (self.moved.poses, self.moved.rates, self.moved.bends)
        )
        arm = turned(np.array(body.centre), pose[:, 2])
        acceleration = bend[:, :2] + bend[:, 2:] * left_of(arm) - rate[:, 2:] ** 2 * arm
        return np.asarray(body.mass * (acceleration - np.asarray(self.mechanism.gravity)))

    def _given(self) -> list[FloatArray]:
        """Forces of slots, closed loops, springs, drives and contacts on each part, N."""
        given = [np.zeros((len(self.time), 2)) for _ in self.mechanism.parts]
        between = [
            *((spring.second.part, spring.first.part, own) for spring, own in self.pulls.items()),
            *((*self.force_parts[name], own) for name, own in self.forces.items()),
            *((*contact.parts, own) for contact, own in self.on_points),
        ]
        pushed = [
            *self.reactions.on_parts,
            *((first, own) for first, _, own in between),
            *((second, -own) for _, second, own in between),
        ]
        for part, force in pushed:
            if part != GROUND:
                given[part] += force
        return given
