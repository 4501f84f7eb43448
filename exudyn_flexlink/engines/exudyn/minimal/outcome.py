"""From a tree's run to a Result: poses, reactions, events, checks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from threading import Event as Asked

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.ending import RADAU, checks
from exudyn_flexlink.engines.exudyn.minimal.closed import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.closure_solver import RANK
from exudyn_flexlink.engines.exudyn.minimal.closures import Track
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Motions, Points, motions
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.problem import MinimalProblem
from exudyn_flexlink.engines.exudyn.minimal.recording import Recorder, TreeKept
from exudyn_flexlink.engines.exudyn.reporting import versions
from exudyn_flexlink.engines.histories import Histories, friction_histories, gear_forces, push_of
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.integrate.stepper import ImplicitStepper
from exudyn_flexlink.mechanism import (
    GROUND,
    Contact,
    force_at,
    left_of,
    line_of,
    sizes_at,
    spring_force,
    tooth_pushes,
    turned,
    without_teeth,
)
from exudyn_flexlink.mechanism.tree import GuidedSlot, hanging_on
from exudyn_flexlink.result import EnergyHistory, EngineSettings, Event, Outcome, Result
from exudyn_flexlink.scene import PointsJoint, Scene


@dataclass
class Reactions:
    """Forces (instants, 2) by joint, N, and on parts; by drive its torque (instants,), N m.

    `torques` of drives along a slide are forces along that, N. `gears` are as in the Result.
    """

    forces: dict[str, FloatArray] = field(default_factory=dict)
    torques: dict[str, FloatArray] = field(default_factory=dict)
    gears: dict[str, FloatArray] = field(default_factory=dict)
    on_parts: list[tuple[int, FloatArray]] = field(default_factory=list)


def reactions_of(
    model: MinimalModel, x: FloatArray, places: FloatArray, forces: FloatArray, poses: FloatArray
) -> Reactions:
    """Reactions at instants (n,) with coordinates x (n, links) and slots' places (n, slots).

    The parts are at `poses` (n, parts, 3).

    `forces` (n, links) are the constraint forces of motors, slots and loops. Where joints are
    redundant their forces are the least of those that are possible.
    """
    if isinstance(model.coordinates, ClosedCoordinates):
        return _of_closures(model, x, places, forces, poses)
    found = Reactions()
    number = {slot.name: k for k, slot in enumerate(model.assembly.mechanism.slots)}
    for guided in model.layout.slots:
        force = _guided(guided, x, places[:, number[guided.slot.name]], forces)
        found.forces[guided.slot.name] = force
        found.on_parts.append((guided.slot.anchor.part, force))
    for ride in model.layout.rides:
        force = forces[:, ride.along]
        found.forces[ride.slot.name] = force
        found.on_parts.append((ride.slot.anchor.part, force))
    for link, (motor, sign) in model.layout.motors.items():
        torque = forces[:, link].copy()
        for guided in model.layout.slots:
            if guided.turning == link:
                torque -= _moment(model, guided, x, found.forces[guided.slot.name])
        found.torques[motor.name] = sign * torque
    return found


def _guided(
    guided: GuidedSlot, x: FloatArray, places: FloatArray, forces: FloatArray
) -> FloatArray:
    """Force of a slot on its point: along the curve's normal, and what holds the slide."""
    normal = guided.slot.curve.normal(places)
    angle = x[:, guided.turning]
    along = normal[:, 0] * np.cos(angle) + normal[:, 1] * np.sin(angle)
    return np.asarray((forces[:, guided.sliding] / along)[:, None] * normal)


def _moment(
    model: MinimalModel, guided: GuidedSlot, x: FloatArray, force: FloatArray
) -> FloatArray:
    """Moment of a slot's force about the guide's pivot, N m."""
    at = Points(model.layout, [guided.slot.anchor]).places(model.kinematics.places(x))[:, 0]
    arm = at - complex(*guided.pivot)
    return np.asarray(arm.real * force[:, 1] - arm.imag * force[:, 0])


def _of_closures(
    model: MinimalModel, x: FloatArray, places: FloatArray, forces: FloatArray, poses: FloatArray
) -> Reactions:
    coordinates = model.coordinates
    assert isinstance(coordinates, ClosedCoordinates)
    closures, motors = coordinates.closures, model.layout.motors
    at = closures.where_on(x, _track(coordinates, places))
    multipliers, rest = _multipliers(closures.jacobian(at), model.layout.known, forces)
    found = Reactions()
    found.gears = {gear.name: multipliers[:, row] for row, gear in closures.gears}
    teeth = [
        push
        for _, gear in closures.gears
        for push in tooth_pushes(gear, found.gears[gear.name], poses)
    ]
    found.on_parts += [(push.part, push.force) for push in teeth]
    in_joints = closures.forces(at, multipliers)
    # Of the gaps those of joints are the first; motors along slides have some, too.
    rows = zip(closures.joints, closures.parts, in_joints.T, strict=False)
    for joint, (first, second), own in rows:
        force = np.stack([own.real, own.imag], axis=-1)
        force = found.forces[joint.name] = without_teeth(joint.name, force, teeth)
        found.on_parts += [(second, force), (first, -force)]
    for row, motor in closures.motors:
        found.torques[motor.name] = multipliers[:, row]
    for link, (motor, sign) in motors.items():
        found.torques[motor.name] = sign * rest[:, link]
    return found


def _track(coordinates: ClosedCoordinates, places: FloatArray) -> Track | None:
    """Slots' curves at places (n, slots) on the whole of them."""
    if not coordinates.points:
        return None
    found = np.zeros((3, *places.shape), dtype=complex)
    for k, point in enumerate(coordinates.points):
        vectors = np.array(point.slot.curve.derivatives(places[:, k]))
        found[:, :, k] = vectors[..., 0] + 1j * vectors[..., 1]
    return Track(*found)


def _multipliers(
    jacobian: FloatArray, known: list[int], forces: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Multipliers (n, rows) of `forces` (n, links), and what is left of those for motors.

    Where joints are redundant, those multipliers that are least. The coordinates `known` are those
    of motors of the tree.
    """
    turned, links = jacobian.transpose(0, 2, 1), forces.shape[1]
    whole = np.zeros(turned.shape[:2])
    whole[:, :links] = forces
    unknown = np.setdiff1d(np.arange(turned.shape[1]), known)
    inverse = np.linalg.pinv(turned[:, unknown], rcond=RANK)
    multipliers = (inverse @ whole[:, unknown, None])[:, :, 0]
    rest = whole - (turned @ multipliers[:, :, None])[:, :, 0]
    return np.asarray(multipliers), np.asarray(rest[:, :links])


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
        self.kept = run.recorder.all_kept()
        own: TreeKept = self.kept.own
        self.time, model = self.kept.t, self.model
        self.moved: Motions = motions(model.layout, model.kinematics, own.x, own.v, own.a)
        self.pulls = {
            spring: spring_force(spring, self.moved.poses, self.moved.rates)
            for spring in self.mechanism.linear_springs
        }
        self.on_points = self._pressing()
        recorder = run.recorder
        self.histories = Histories(
            self.mechanism,
            self.moved.poses,
            self.moved.rates,
            self.kept.press,
            recorder.seeker.deepest,
            lambda first, count: recorder.intervals(first, run.problem.places[first:][:count]),
        )
        self.forces = {
            force.name: force_at(force, self.time, self.moved.poses, self.moved.rates)
            for force in self.mechanism.forces
        }
        self.force_parts = {
            force.name: (force.point.part, GROUND) for force in self.mechanism.forces
        }
        self.reactions = reactions_of(model, own.x, self.kept.places, own.forces, self.moved.poses)
        for motor in self.mechanism.speed_motors:
            if motor.slide:
                line = line_of(motor.slide, self.moved.poses)
                self.forces[motor.name] = self.reactions.torques.pop(motor.name)[:, None] * line
                self.force_parts[motor.name] = motor.second, motor.first

    def _pressing(self) -> list[tuple[Contact, FloatArray]]:
        """Forces (samples, 2) of contacts on the first parts, N."""
        found, pressed = [], self.kept.pressed
        for k in np.flatnonzero(pressed.any(axis=0)).tolist():
            contact, rows = self.run.recorder.contacts[k], pressed[:, k]
            at = self.moved.poses[rows], self.moved.rates[rows]
            push = np.zeros((len(rows), 2))
            push[rows] = push_of(contact, *at, self.kept.press[rows, k])
            found.append((contact, push))
        return found

    def result(self, warnings: tuple[str, ...], outcome: Outcome) -> Result:
        """Return the Result; its timings are still to come."""
        poses, rates, own = self.moved.poses, self.moved.rates, self.kept.own
        recorder = self.run.recorder
        energies = recorder.energies(self.kept, poses, rates)
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
            checks=checks(self.run.stepper, recorder, self._deepest()),
            warnings=warnings,
            outcome=outcome,
            frictions=friction_histories(
                self.mechanism, self.time, own.rests, own.friction, self.kept.totals[:, 2:]
            ),
            gear_forces=gear_forces(self.mechanism, self.reactions.gears, in_newtons=True),
            gear_torques=gear_forces(self.mechanism, self.reactions.gears, in_newtons=False),
        )

    def _deepest(self) -> float:
        """Largest penetration, m; of stops and ropes it is a stretch, or an angle."""
        scene, seeker = self.run.scene, self.run.recorder.seeker
        others = {*scene.stops, *scene.ropes}
        own = [contact.name not in others for contact in seeker.contacts]
        return float(seeker.deepest[own].max(initial=0.0))

    def _settings(self) -> EngineSettings:
        step = self.run.scene.accuracy.step
        tolerance = self.run.stepper.control.tolerance if step is None else None
        return EngineSettings(replace(RADAU, tolerance=tolerance, step=step), "minimal")

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
