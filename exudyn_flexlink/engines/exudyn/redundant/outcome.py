"""After the solve: samples to a Result, with its events, checks, warnings and how it ended."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics.contacts import shortened
from exudyn_flexlink.engines.ending import outcome_of
from exudyn_flexlink.engines.exudyn.redundant.recording import BESIDE, SolverKept
from exudyn_flexlink.engines.exudyn.redundant.stepping import Loop
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.engines.exudyn.reporting import LOCKED_ADVICE, NO_SOLUTION, no_solution_advice
from exudyn_flexlink.engines.histories import Histories
from exudyn_flexlink.expressions import NoValueError
from exudyn_flexlink.mechanism import (
    Assembly,
    Motor,
    Pin,
    Slide,
    Weld,
    force_at,
    joint_speed,
    left_of,
    line_of,
    sizes_at,
    tooth_pushes,
    without_teeth,
)
from exudyn_flexlink.result import INTERRUPTED, EngineSettings, Integrator, Outcome, Result
from exudyn_flexlink.scene import PointsJoint, Scene

CREEPS = 3.0  # of the slip speed: what is slower is held by less than 0.995 of the bound
METHOD, ORDER = "generalised-alpha, index 3", 2


@dataclass(frozen=True)
class Prepared:
    """Everything a solve needs, and what is left of it afterwards."""

    scene: Scene
    assembly: Assembly
    system: System
    loop: Loop
    seed: bool = False


def finish(prepared: Prepared, complaint: str) -> Result:
    """Put the Result together; its timings are still to come."""
    return _RunReader(prepared).result(complaint)


class _RunReader:
    """Reads what a run recorded, and puts its Result together."""

    def __init__(self, prepared: Prepared) -> None:
        self.prepared, self.recorder = prepared, prepared.loop.recorder
        self.mechanism, self.system = prepared.assembly.mechanism, prepared.system
        self.kept = self.recorder.all_kept()
        self.poses, self.rates = self.recorder.motion(self.kept)
        own: SolverKept = self.kept.own
        self.multipliers = own.multipliers
        # Drives are as they were within the step that ended there.
        self.state = np.maximum(self.kept.t - BESIDE, 0.0), self.poses, self.rates

    def result(self, complaint: str) -> Result:
        """Return the Result; its timings are still to come."""
        prepared, loop = self.prepared, self.prepared.loop
        given = prepared.scene.accuracy.step
        touching = [own.touch for own in loop.contacts.all]
        places = np.array([0.0 if own is None else own.place for own in touching])
        return Histories(
            prepared.scene, loop, self.recorder, self.kept, self.poses, self.rates, places
        ).result(
            loop.events,
            self._joint_forces(),
            gears=self._of_gears(),
            frictions=self._frictions(),
            steps_per_contact=min(
                (own.resolution.steps(given) for own in loop.contacts.all), default=inf
            ),
            engine="exudyn",
            settings=_engine_settings(prepared),
            drive_torques=self._torques(),
            drive_forces=self._drive_forces(),
            slot_forces={
                slot.slot.name: slot.force(self.multipliers, self.poses, self.kept.places[:, k])
                for k, slot in enumerate(loop.slots)
            },
            warnings=(*self._shortened(), *self._creeping()),
            outcome=_outcome(prepared, complaint),
        )

    def _of_gears(self) -> dict[str, FloatArray]:
        """Multiplier (samples,) of each gear."""
        numbers = zip(self.mechanism.gears, self.system.gears, strict=True)
        return {
            gear.name: -self.multipliers[:, self.system.multipliers(number)[0]]
            for gear, number in numbers
        }

    def _frictions(self) -> tuple[FloatArray, FloatArray]:
        """Joints with friction (samples, joints) never rest, and their torques or forces."""
        torques = np.transpose(
            [
                own.regularised(joint_speed(own.joint, self.poses, self.rates))
                for own in self.mechanism.frictions
            ]
        )
        return np.zeros_like(torques), torques

    def _shortened(self) -> Iterator[str]:
        contacts = self.prepared.loop.contacts
        every = [(own.resolution.half_period, own.resolution.step) for own in contacts.all]
        touched = every if contacts.touches.ever else []
        return shortened(self.prepared.scene.accuracy.step, touched)

    def _creeping(self) -> Iterator[str]:
        """Say that friction holds nothing here, and how fast a joint creeps as the run ends."""
        for own in self.mechanism.frictions:
            speed = abs(float(joint_speed(own.joint, self.poses[-1], self.rates[-1])))
            unit = "m/s" if isinstance(own.joint, Slide) else "rad/s"
            creeps = "what should rest creeps"
            if 0 < speed < CREEPS * own.slip_speed:
                creeps = f"it creeps by {speed:.2g} {unit} as the run ends"
            yield (
                f"friction in joint '{own.name}' holds nothing in redundant coordinates: {creeps}, "
                "by slip_speed artanh(load/bound); 'formulation: minimal' holds"
            )

    def _torques(self) -> dict[str, FloatArray]:
        """Torque of each drive that has one on its joint's second part, N m."""
        torques = {
            motor.name: -self.multipliers[:, row]
            for motor, row in self._motors()
            if motor.slide is None
        }
        for torque in self.mechanism.torque_motors:
            torques[torque.name] = sizes_at(torque.size, *self.state)
        return torques

    def _drive_forces(self) -> dict[str, FloatArray]:
        """Force of each drive that has one, at its point or on its joint's second part, N."""
        found = {force.name: force_at(force, *self.state) for force in self.mechanism.forces}
        for motor, row in self._motors():
            if motor.slide:
                line = line_of(motor.slide, self.poses)
                found[motor.name] = -self.multipliers[:, row, None] * line
        return found

    def _motors(self) -> Iterator[tuple[Motor, int]]:
        """Speed motors, and the multiplier that is the torque or force of each."""
        return zip(self.mechanism.speed_motors, self.recorder.motor_rows, strict=True)

    def _joint_forces(self) -> dict[str, FloatArray]:
        """Force of each joint of two points of the scene on its second one, N, global axes."""
        system, joints, found = self.system, self.prepared.scene.joints, {}
        mechanism = self.mechanism
        teeth = tooth_pushes(mechanism.gears, self._of_gears(), self.poses)
        held: list[Pin | Weld | Slide] = [*mechanism.pins, *mechanism.welds, *mechanism.slides]
        for joint in held:
            if not isinstance(joints.get(joint.name), PointsJoint):
                continue
            rows = system.multipliers(system.joints[joint.name])
            if isinstance(joint, Slide):
                normal = left_of(line_of(joint, self.poses))
                found[joint.name] = -self.multipliers[:, rows[:1]] * normal
            else:
                force = np.asarray(-self.multipliers[:, rows])
                found[joint.name] = without_teeth(joint.name, force, teeth)
        return found


def _engine_settings(prepared: Prepared) -> EngineSettings:
    scene, beams = prepared.scene, prepared.system.beams
    contact_step = min((own.contact_step for own in prepared.loop.contacts.all), default=inf)
    return EngineSettings(
        Integrator(
            METHOD,
            ORDER,
            tolerance=prepared.loop.chooser.tolerance,
            step=scene.accuracy.step,
            spectral_radius=scene.solver.spectral_radius,
        ),
        formulation="beam" if beams else "redundant",
        elements=beams[0].shape.elements if beams else None,
        steps_per_contact=scene.solver.steps_per_contact,
        contact_step=contact_step if isfinite(contact_step) else None,
    )


def _outcome(prepared: Prepared, complaint: str) -> Outcome:
    loop = prepared.loop
    reasons = [(INTERRUPTED if loop.interrupted else "", ""), (loop.stop_reason, loop.stop_advice)]
    if complaint:
        reasons.append((_plain(complaint), _advice(prepared, complaint)))
    if loop.time < loop.end * (1 - 1e-9) and loop.goal is None:
        reasons.append(("the solver stopped early", "report this model, please"))
    return outcome_of(prepared.scene, prepared.assembly.mechanism, loop.time, loop.left, reasons)


def _plain(complaint: str) -> str:
    if "singular" in complaint:
        return "the equations became singular: a dead centre, or joints that contradict each other"
    if "step size" in complaint or "Newton" in complaint:
        return NO_SOLUTION
    return complaint.strip().splitlines()[0]


def _advice(prepared: Prepared, complaint: str) -> str:
    if prepared.system.errors:
        return NoValueError.advice
    if "singular" in complaint:
        return LOCKED_ADVICE
    return no_solution_advice(prepared.assembly, prepared.scene.accuracy.tolerance)
