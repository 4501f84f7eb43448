"""Runs of a scene as rigid bodies with joints, by index-3 generalised-alpha; see `stepping`.

After the solve the samples become a Result, with its events, checks, warnings and outcome.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import ceil, inf, isfinite
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.diagnostics import shortened
from exudyn_flexlink.engines.exudyn.engine import (
    LOCKED_ADVICE,
    NO_SOLUTION,
    Engine,
    no_solution_advice,
)
from exudyn_flexlink.engines.exudyn.redundant.beam import beams_of
from exudyn_flexlink.engines.exudyn.redundant.contacts import (
    ContactItem,
    Contacts,
    add_joint_friction,
)
from exudyn_flexlink.engines.exudyn.redundant.recording import BESIDE, SolverKept, StepRecorder
from exudyn_flexlink.engines.exudyn.redundant.slots import Kinks, SlotItems
from exudyn_flexlink.engines.exudyn.redundant.stepping import Loop, StepChooser
from exudyn_flexlink.engines.exudyn.redundant.system import (
    System,
    add_loads,
    build_system,
    loads_sense_state,
)
from exudyn_flexlink.engines.finer import seeded
from exudyn_flexlink.engines.interrupts import interrupts, outcome_of
from exudyn_flexlink.engines.recording import Histories
from exudyn_flexlink.engines.touching import HERMITE, ExtremeSeeker
from exudyn_flexlink.expressions import NoValueError
from exudyn_flexlink.integrate.solve import ProgressMeter
from exudyn_flexlink.mechanism import (
    Assembly,
    CurveContact,
    FlatContact,
    Motor,
    Pin,
    RopeContact,
    Slide,
    SumStop,
    Weld,
    beyond_redundant,
    end_of_run,
    force_at,
    joint_speed,
    left_of,
    line_of,
    resolutions,
    sample_times,
    sizes_at,
    tooth_pushes,
    turn_goal,
    without_teeth,
)
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import INTERRUPTED, EngineSettings, Event, Integrator, Outcome, Result
from exudyn_flexlink.scene import PointsJoint, Scene

CREEPS = 3.0  # of the slip speed: slower joints are held by less than 0.995 of the bound
METHOD, ORDER = "generalised-alpha, index 3", 2


@dataclass(frozen=True)
class Prepared:
    """All objects that a solve reads and changes."""

    scene: Scene
    assembly: Assembly
    system: System
    loop: Loop
    seed: bool = False


def finish(prepared: Prepared, complaint: str) -> Result:
    """Make the Result; timings are added later."""
    return _SolverRunReader(prepared).result(complaint)


class _SolverRunReader:
    """Makes the Result from the records of a run."""

    def __init__(self, prepared: Prepared) -> None:
        self.prepared, self.recorder = prepared, prepared.loop.recorder
        self.mechanism, self.system = prepared.assembly.mechanism, prepared.system
        self.kept = self.recorder.all_kept()
        self.poses, self.rates = self.recorder.motion(self.kept)
        kept: SolverKept = self.kept.of_engine
        self.multipliers = kept.multipliers
        # Drives have their values within the step that ends at the instant.
        self.state = np.maximum(self.kept.t - BESIDE, 0.0), self.poses, self.rates

    def result(self, complaint: str) -> Result:
        """Return the Result; timings are added later."""
        prepared, loop = self.prepared, self.prepared.loop
        given = prepared.scene.accuracy.step
        touching = [contact.touch for contact in loop.contacts.all]
        places = np.array([0.0 if touch is None else touch.place for touch in touching])
        return Histories(
            prepared.scene, loop, self.recorder, self.kept, self.poses, self.rates, places
        ).result(
            loop.events,
            self._joint_forces(),
            gears=self._of_gears(),
            frictions=self._frictions(),
            steps_per_contact=min(
                (contact.resolution.steps(given) for contact in loop.contacts.all), default=inf
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
        """Whether joints with friction rest (samples, joints): never; their torques or forces."""
        torques = np.transpose(
            [
                friction.regularised(joint_speed(friction.joint, self.poses, self.rates))
                for friction in self.mechanism.frictions
            ]
        )
        return np.zeros_like(torques), torques

    def _shortened(self) -> Iterator[str]:
        contacts = self.prepared.loop.contacts
        durations = [
            (contact.resolution.half_period, contact.resolution.step) for contact in contacts.all
        ]
        touched = durations if contacts.touches.ever else []
        return shortened(self.prepared.scene.accuracy.step, touched)

    def _creeping(self) -> Iterator[str]:
        """Warn that friction holds nothing, with the speed of a joint that creeps at the end."""
        for friction in self.mechanism.frictions:
            speed = abs(float(joint_speed(friction.joint, self.poses[-1], self.rates[-1])))
            unit = "m/s" if isinstance(friction.joint, Slide) else "rad/s"
            creeps = "what should rest creeps"
            if 0 < speed < CREEPS * friction.slip_speed:
                creeps = f"it creeps by {speed:.2g} {unit} as the run ends"
            yield (
                f"friction in joint '{friction.name}' holds nothing in redundant coordinates: "
                f"{creeps}, by slip_speed artanh(load/bound); 'formulation: minimal' holds"
            )

    def _torques(self) -> dict[str, FloatArray]:
        """Torque of each rotary drive on its joint's second part, N m."""
        torques = {
            motor.name: -self.multipliers[:, row]
            for motor, row in self._motors()
            if motor.slide is None
        }
        for torque in self.mechanism.torque_motors:
            torques[torque.name] = sizes_at(torque.size, *self.state)
        return torques

    def _drive_forces(self) -> dict[str, FloatArray]:
        """Force, N, of each drive at a point or along a slide; on its joint's second part."""
        forces = {force.name: force_at(force, *self.state) for force in self.mechanism.forces}
        for motor, row in self._motors():
            if motor.slide:
                line = line_of(motor.slide, self.poses)
                forces[motor.name] = -self.multipliers[:, row, None] * line
        return forces

    def _motors(self) -> Iterator[tuple[Motor, int]]:
        """Speed motors, and the multiplier that is the torque or force of each."""
        return zip(self.mechanism.speed_motors, self.recorder.motor_rows, strict=True)

    def _joint_forces(self) -> dict[str, FloatArray]:
        """Force of each joint of two points on its second point, N, global axes."""
        system, joints, forces = self.system, self.prepared.scene.joints, {}
        mechanism = self.mechanism
        teeth = tooth_pushes(mechanism.gears, self._of_gears(), self.poses)
        held: list[Pin | Weld | Slide] = [*mechanism.pins, *mechanism.welds, *mechanism.slides]
        for joint in held:
            if not isinstance(joints.get(joint.name), PointsJoint):
                continue
            rows = system.multipliers(system.joints[joint.name])
            if isinstance(joint, Slide):
                normal = left_of(line_of(joint, self.poses))
                forces[joint.name] = -self.multipliers[:, rows[:1]] * normal
            else:
                force = np.asarray(-self.multipliers[:, rows])
                forces[joint.name] = without_teeth(joint.name, force, teeth)
        return forces


def _engine_settings(prepared: Prepared) -> EngineSettings:
    scene, beams = prepared.scene, prepared.system.beams
    contact_step = min(
        (contact.contact_step for contact in prepared.loop.contacts.all), default=inf
    )
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


def prepare(
    scene: Scene,
    assembly: Assembly,
    progress: Callable[[float], None] | None,
    limits: float = 1.0,
    *,
    seed: bool = False,
) -> Prepared:
    """Build the system, the loop and the recorder.

    Raises:
        NotRepresentableError: see `built`.

    """
    end = end_of_run(scene, assembly.mechanism)
    events: list[Event] = []
    system, slots, contacts = built(scene, assembly, events, limits)
    system.mbs.Assemble()
    watched = Watched(scene, assembly.mechanism, assembly.state.q)
    pressing = [contact.contact for contact in contacts.all]
    recorder = StepRecorder(
        system,
        sample_times(scene, assembly.mechanism, end),
        scene.solver.spectral_radius,
        ExtremeSeeker(watched, pressing, HERMITE),
        contacts.touches,
    )
    chooser = StepChooser(scene.accuracy, end, system.coordinates.weights, limits)
    goal = turn_goal(scene, assembly)
    knots, window = assembly.mechanism.knots(end), system.window
    meter = ProgressMeter(progress, end)
    kinks = Kinks(assembly.mechanism, window)
    loop = Loop(chooser, slots, contacts, kinks, events, recorder, end, goal, knots, window, meter)
    return Prepared(scene, assembly, system, loop, seed)


def built(
    scene: Scene, assembly: Assembly, events: list[Event], limits: float = 1.0
) -> tuple[System, list[SlotItems], Contacts]:
    """Create all items of a scene, not yet assembled; slots will add new laps to `events`.

    Raises:
        NotRepresentableError: the scene asks for a beam that is not possible, or for contacts that
            Exudyn's own solver lacks.

    """
    for mistake in beyond_redundant(scene):
        raise NotRepresentableError(tuple(map(str, mistake.path)), mistake.message)
    as_beam = scene.solver.formulation == "beam"
    beams = beams_of(scene, assembly.mechanism) if as_beam else ()
    system = build_system(assembly, beams)
    for friction in system.mechanism.frictions:
        add_joint_friction(system, friction)
    add_loads(system)
    count = len(assembly.mechanism.slots)
    slots = [SlotItems(system, i, events, limits) for i in range(count)]
    return system, slots, _contacts(scene, system)


def _contacts(scene: Scene, system: System) -> Contacts:
    """Contacts of scene and bearings, then pairs of channels: the order in all arrays."""
    mechanism = system.mechanism
    resolved = resolutions(scene, system.assembly, system.coordinates.half_period)
    count = len(mechanism.touching)
    contacts = []
    for i, (contact, resolution) in enumerate(zip(mechanism.touching, resolved, strict=False)):
        # `prepare` refuses them
        assert not isinstance(contact, (CurveContact, FlatContact, RopeContact, SumStop))
        contacts.append(ContactItem(system, contact, i, resolution))
    for channel, resolution in zip(mechanism.channels, resolved[count:], strict=True):
        for pair in channel.contacts:
            contacts.append(ContactItem(system, pair, len(contacts), resolution, channel))
    return Contacts(contacts)


def solve(prepared: Prepared) -> str:
    """Run the solver; return its complaint, empty if it has none."""
    system, loop = prepared.system, prepared.loop
    q, v, a = system.coordinates.start()
    data = system.mbs.systemData
    if prepared.seed:
        q, v = seeded(system.assembly, (q, v), system.coordinates.weights)
        data.SetODE2Coordinates(q, Engine.ConfigurationType.Initial)
        data.SetODE2Coordinates_t(v, Engine.ConfigurationType.Initial)
    # Exudyn's own initial accelerations lack terms that depend on time explicitly, and are wrong
    # for quadratic constraints. So those of the mechanism's equations are set.
    data.SetODE2Coordinates_tt(a, Engine.ConfigurationType.Initial)
    multipliers = np.zeros(len(data.GetAECoordinates()))
    first = loop.start(q, v, multipliers)
    system.mbs.SetPostStepUserFunction(loop.after_step)
    settings = _settings(prepared, first)
    complaint = ""
    try:
        with interrupts(loop.interrupt):
            system.mbs.SolveDynamic(settings, showHints=False)
    except Exception as error:
        complaint = str(system.mbs.sys["dynamicSolver"].GetErrorString() or error)
    if isinstance(loop.error, NoValueError):  # of a drive beyond a knot
        system.errors.append(loop.error)
        complaint = str(loop.error)
    elif loop.error is not None:
        raise loop.error
    if system.errors and complaint:
        complaint = str(system.errors[-1])
    if loop.time < loop.end * (1 - 1e-9):
        loop.recorder.keep_last()  # stopped early
    loop.recorder.flush()
    return complaint


def _settings(prepared: Prepared, first: float) -> Any:
    settings = Engine.SimulationSettings()
    time = settings.timeIntegration
    time.endTime = prepared.loop.end
    # After a failed step the solver returns to steps of endTime/numberOfSteps: at most our largest.
    largest = prepared.loop.chooser.largest
    time.numberOfSteps = max(1, ceil(prepared.loop.end / largest))
    time.initialStepSize = first
    time.minimumStepSize = min(1e-10, first / 10)
    # By default the solver doubles a step that is shorter than its own every few steps.
    time.adaptiveStepRecoverySteps = 10**9
    time.generalizedAlpha.spectralRadius = prepared.scene.solver.spectral_radius
    time.generalizedAlpha.computeInitialAccelerations = False
    time.newton.useModifiedNewton = True
    time.newton.modifiedNewtonJacUpdatePerStep = True
    time.computeLoadsJacobian = int(loads_sense_state(prepared.system))
    time.newton.relativeTolerance, time.newton.absoluteTolerance = prepared.system.newton
    time.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    settings.linearSolver.solverType = Engine.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True
    return settings
