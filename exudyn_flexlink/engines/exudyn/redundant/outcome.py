"""After the solve: samples to a Result, with its events, checks, warnings and how it ended."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics.contacts import shortened
from exudyn_flexlink.engines.ending import of_turns
from exudyn_flexlink.engines.exudyn.redundant.intervals import Written
from exudyn_flexlink.engines.exudyn.redundant.recording import just_before
from exudyn_flexlink.engines.exudyn.redundant.stepping import Loop
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.engines.exudyn.reporting import (
    LOCKED_ADVICE,
    NO_SOLUTION,
    NO_VALUE_ADVICE,
    no_solution_advice,
    versions,
)
from exudyn_flexlink.engines.histories import Histories
from exudyn_flexlink.mechanism import (
    Assembly,
    Pin,
    Weld,
    force_at,
    left_of,
    line_of,
    sizes_at,
    spring_force,
)
from exudyn_flexlink.result import (
    INTERRUPTED,
    Checks,
    EnergyHistory,
    EngineSettings,
    Integrator,
    Outcome,
    Result,
)
from exudyn_flexlink.scene import PrismaticJoint, Scene

METHOD, ORDER = "generalised-alpha, index 3", 2


@dataclass(frozen=True)
class Prepared:
    """Everything a solve needs, and what is left of it afterwards."""

    scene: Scene
    assembly: Assembly
    system: System
    loop: Loop


def finish(prepared: Prepared, complaint: str) -> Result:
    """Put the Result together; its timings are still to come."""
    kept = {
        key: np.concatenate(value) for key, value in vars(prepared.loop.recorder.samples).items()
    }
    poses, rates, mechanism = kept["poses"], kept["rates"], prepared.assembly.mechanism
    written = _written(prepared)
    deepest = written.seeker.deepest
    forces = kept["forces"]
    histories = Histories(mechanism, poses, rates, forces, deepest, written.intervals)
    return Result(
        scene=prepared.scene,
        engine="exudyn",
        settings=_settings(prepared),
        versions=versions(),
        timings={},
        part_names=tuple(part.name for part in mechanism.parts),
        time=kept["time"],
        poses=poses,
        rates=rates,
        drive_torques=_torques(prepared, kept),
        drive_forces=_drive_forces(prepared, kept),
        joint_forces=_joint_forces(prepared, poses, kept["multipliers"])
        | histories.bearing_forces(),
        slot_forces=_slot_forces(prepared, poses, kept),
        spring_forces={
            spring.name: spring_force(spring, poses, rates)
            for spring in mechanism.linear_springs
            if spring.name in prepared.scene.springs
        },
        contacts=histories.contacts(),
        bearings=histories.bearings(),
        sleeves=histories.sleeves(),
        energy=EnergyHistory(*kept["energies"].T),
        extremes=prepared.loop.recorder.seeker.extremes(),
        # A lap that begins as the run ends is none.
        laps=tuple(lap for lap in prepared.loop.events if lap.time < prepared.loop.end),
        checks=_checks(prepared),
        warnings=tuple(_warnings(prepared)),
        outcome=_outcome(prepared, complaint),
    )


def _settings(prepared: Prepared) -> EngineSettings:
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


def _written(prepared: Prepared) -> Written:
    """Return what the run wrote down of its contacts and of its channels' pairs."""
    recorder, entries = prepared.loop.recorder, prepared.loop.contacts.entries
    at_end = list(zip(recorder.impulse.tolist(), recorder.work.tolist(), strict=True))
    return Written(entries, recorder.totals, at_end, recorder.force.tolist(), recorder.seeker)


def _torques(prepared: Prepared, kept: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Torque of each drive that has one on its joint's second part, N m."""
    mechanism = prepared.assembly.mechanism
    time, poses, rates = just_before(kept["time"]), kept["poses"], kept["rates"]
    rows = prepared.loop.recorder.motor_rows
    torques = {
        motor.name: -kept["multipliers"][:, row]
        for motor, row in zip(mechanism.speed_motors, rows, strict=True)
        if motor.slide is None
    }
    for torque in mechanism.torque_motors:
        torques[torque.name] = sizes_at(torque.size, time, poses, rates)
    return torques


def _drive_forces(prepared: Prepared, kept: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Force of each drive that has one, at its point or on its joint's second part, N."""
    mechanism = prepared.assembly.mechanism
    state = just_before(kept["time"]), kept["poses"], kept["rates"]
    found = {force.name: force_at(force, *state) for force in mechanism.forces}
    for motor, row in zip(mechanism.speed_motors, prepared.loop.recorder.motor_rows, strict=True):
        if motor.slide:
            line = line_of(motor.slide, kept["poses"])
            found[motor.name] = -kept["multipliers"][:, row, None] * line
    return found


def _joint_forces(
    prepared: Prepared, poses: FloatArray, multipliers: FloatArray
) -> dict[str, FloatArray]:
    """Force of each joint of two points of the scene on its second one, N, global axes."""
    system, joints = prepared.system, prepared.scene.joints
    found = {}
    meeting: tuple[Pin | Weld, ...] = (*system.mechanism.pins, *system.mechanism.welds)
    for pin in meeting:
        if pin.name in joints:
            found[pin.name] = -multipliers[:, system.multipliers(system.joints[pin.name])]
    for slide in system.mechanism.slides:
        if isinstance(joints.get(slide.name), PrismaticJoint):
            across = multipliers[:, system.multipliers(system.joints[slide.name])[0]]
            found[slide.name] = -across[:, None] * left_of(line_of(slide, poses))
    return found


def _slot_forces(
    prepared: Prepared, poses: FloatArray, kept: dict[str, FloatArray]
) -> dict[str, FloatArray]:
    return {
        slot.slot.name: slot.force(kept["multipliers"], poses, kept["places"][:, k])
        for k, slot in enumerate(prepared.loop.slots)
    }


def _checks(prepared: Prepared) -> Checks:
    loop, recorder = prepared.loop, prepared.loop.recorder
    given = prepared.scene.accuracy.step
    per_contact = min((own.resolution.steps(given) for own in loop.contacts.all), default=inf)
    return Checks(
        energy_residual=recorder.energy_residual,
        largest_kinetic_energy=recorder.largest_kinetic_energy,
        constraint_error=recorder.constraint_error,
        steps=max(recorder.steps, 0),
        newton_iterations=int(prepared.system.mbs.sys["dynamicSolver"].it.newtonStepsCount),
        smallest_step=loop.smallest_step if isfinite(loop.smallest_step) else 0.0,
        largest_step=loop.largest_step,
        steps_per_contact=per_contact,
        largest_penetration=float(recorder.seeker.deepest.max(initial=0.0)),
    )


def _warnings(prepared: Prepared) -> list[str]:
    """Say that contacts were resolved by steps shorter than the one that the scene gives."""
    given = prepared.scene.accuracy.step
    touched = any(entry.kind == "contact begins" for entry in prepared.loop.contacts.entries)
    resolutions = [contact.resolution for contact in prepared.loop.contacts.all]
    shorter = [own for own in resolutions if given is not None and own.step < given]
    if given is None or not (touched and shorter):
        return []
    shortest = min(shorter, key=lambda own: own.step)
    return [shortened(given, shortest.half_period, shortest.step)]


def _outcome(prepared: Prepared, complaint: str) -> Outcome:
    loop = prepared.loop
    if loop.interrupted:
        return Outcome(False, loop.time, INTERRUPTED)
    if loop.stop_reason:
        return Outcome(False, loop.time, loop.stop_reason, loop.stop_advice)
    if complaint:
        return Outcome(False, loop.time, _plain(complaint), _advice(prepared, complaint))
    if loop.time < loop.end * (1 - 1e-9) and loop.goal is None:
        return Outcome(False, loop.time, "the solver stopped early", "report this model, please")
    return of_turns(prepared.scene, prepared.assembly.mechanism, loop.time, loop.left)


def _plain(complaint: str) -> str:
    if "singular" in complaint:
        return "the equations became singular: a dead centre, or joints that contradict each other"
    if "step size" in complaint or "Newton" in complaint:
        return NO_SOLUTION
    return complaint.strip().splitlines()[0]


def _advice(prepared: Prepared, complaint: str) -> str:
    if prepared.system.errors:
        return NO_VALUE_ADVICE
    if "singular" in complaint:
        return LOCKED_ADVICE
    return no_solution_advice(prepared.assembly, prepared.scene.accuracy.tolerance)
