"""Runs of a scene as a tree of links, in minimal coordinates, with error-controlled Radau steps.

After the solve the tree's motion becomes a Result: poses, reactions, events, checks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.engines.diagnostics import passed_on, shortened
from exudyn_flexlink.engines.exudyn.engine import LOCKED_ADVICE, NO_SOLUTION, no_solution_advice
from exudyn_flexlink.engines.exudyn.minimal.closures import RANK, ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.friction import LockedError
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Motions, Points, motions
from exudyn_flexlink.engines.exudyn.minimal.model import TROUBLES, MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.problem import MinimalProblem
from exudyn_flexlink.engines.exudyn.minimal.recording import TreeKept, TreeRecorder
from exudyn_flexlink.engines.finer import LATE
from exudyn_flexlink.engines.interrupts import TOO_DEEP_ADVICE, interrupts, outcome_of, radau
from exudyn_flexlink.engines.recording import Histories, push_of
from exudyn_flexlink.engines.touching import FIRST, ExtremeSeeker, error_times
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.problem import NoConvergenceError, instant, stages_for
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.integrate.stepper import ErrorControl, ImplicitStepper
from exudyn_flexlink.mechanism import (
    GROUND,
    Assembly,
    Contact,
    end_of_run,
    force_at,
    half_periods,
    left_of,
    line_of,
    sample_times,
    sizes_at,
    spring_force,
    tooth_pushes,
    turn_goal,
    turned,
    without_teeth,
)
from exudyn_flexlink.mechanism.tree import GuidedSlot, TreeLayout, hanging_on, tree_layout
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import INTERRUPTED, EngineSettings, Event, Outcome, Result
from exudyn_flexlink.scene import PointsJoint, Scene
from exudyn_flexlink.source import Mistake, SceneError


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
    reactions = Reactions()
    number = {slot.name: k for k, slot in enumerate(model.assembly.mechanism.slots)}
    for guided in model.layout.slots:
        force = _guided(guided, x, places[:, number[guided.slot.name]], forces)
        reactions.forces[guided.slot.name] = force
        reactions.on_parts.append((guided.slot.anchor.part, force))
    for ride in model.layout.rides:
        force = forces[:, ride.along]
        reactions.forces[ride.slot.name] = force
        reactions.on_parts.append((ride.slot.anchor.part, force))
    for link, (motor, sign) in model.layout.motors.items():
        torque = forces[:, link].copy()
        for guided in model.layout.slots:
            if guided.turning == link:
                torque -= _moment(model, guided, x, reactions.forces[guided.slot.name])
        reactions.torques[motor.name] = sign * torque
    return reactions


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
    # Places count along the whole curves, not on their present pieces.
    curves = [point.slot.curve.places for point in coordinates.points]
    jacobian = closures.jacobian(closures.joined(x, places), curves)
    multipliers, rest = _multipliers(jacobian, closures.known, forces)
    reactions = Reactions()
    reactions.gears = {gear.name: multipliers[:, row] for row, gear in closures.gears}
    teeth = tooth_pushes((gear for _, gear in closures.gears), reactions.gears, poses)
    reactions.on_parts += [(push.part, push.force) for push in teeth]
    in_joints = closures.forces(x, multipliers)
    # Of the gaps those of joints are the first; motors along slides have some, too.
    rows = zip(closures.joints, closures.parts, in_joints.T, strict=False)
    for joint, (first, second), reaction in rows:
        force = np.stack([reaction.real, reaction.imag], axis=-1)
        force = reactions.forces[joint.name] = without_teeth(joint.name, force, teeth)
        reactions.on_parts += [(second, force), (first, -force)]
    for row, motor in closures.motors:
        reactions.torques[motor.name] = multipliers[:, row]
    for link, (motor, sign) in motors.items():
        reactions.torques[motor.name] = sign * rest[:, link]
    return reactions


def _multipliers(
    jacobian: FloatArray, known: IndexArray, forces: FloatArray
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
    recorder: TreeRecorder
    events: list[Event]


class RunReader:
    """Reads what a run recorded, and puts its Result together."""

    def __init__(self, run: MinimalRun) -> None:
        self.run = run
        self.model, self.mechanism = run.model, run.model.assembly.mechanism
        self.kept = run.recorder.all_kept()
        kept: TreeKept = self.kept.of_engine
        self.time, model = self.kept.t, self.model
        self.moved: Motions = motions(model.layout, model.kinematics, kept.x, kept.v, kept.a)
        self.pulls = {
            spring: spring_force(spring, self.moved.poses, self.moved.rates)
            for spring in self.mechanism.linear_springs
        }
        self.on_points = self._pressing()
        self.forces = {
            force.name: force_at(force, self.time, self.moved.poses, self.moved.rates)
            for force in self.mechanism.forces
        }
        self.force_parts = {
            force.name: (force.point.part, GROUND) for force in self.mechanism.forces
        }
        self.reactions = reactions_of(
            model, kept.x, self.kept.places, kept.forces, self.moved.poses
        )
        for motor in self.mechanism.speed_motors:
            if motor.slide:
                line = line_of(motor.slide, self.moved.poses)
                self.forces[motor.name] = self.reactions.torques.pop(motor.name)[:, None] * line
                self.force_parts[motor.name] = motor.second, motor.first

    def _pressing(self) -> list[tuple[Contact, FloatArray]]:
        """Forces (samples, 2) of contacts on the first parts, N."""
        points, pressed = [], self.kept.pressed
        for k in np.flatnonzero(pressed.any(axis=0)).tolist():
            contact, rows = self.run.recorder.contacts[k], pressed[:, k]
            at = self.moved.poses[rows], self.moved.rates[rows]
            push = np.zeros((len(rows), 2))
            push[rows] = push_of(contact, *at, self.kept.press[rows, k])
            points.append((contact, push))
        return points

    def result(self, warnings: tuple[str, ...], outcome: Outcome) -> Result:
        """Return the Result; its versions and timings are still to come."""
        run, poses, rates = self.run, self.moved.poses, self.moved.rates
        kept: TreeKept = self.kept.of_engine
        histories = Histories(
            run.scene, run.stepper, run.recorder, self.kept, poses, rates, run.problem.places
        )
        return histories.result(
            run.events,
            self._joint_forces(),
            gears=self.reactions.gears,
            frictions=(kept.rests, kept.friction),
            engine="exudyn",
            settings=self._settings(),
            drive_torques=self._torques(),
            drive_forces=self.forces,
            slot_forces={s.name: self.reactions.forces[s.name] for s in self.mechanism.slots},
            warnings=warnings,
            outcome=outcome,
        )

    def _settings(self) -> EngineSettings:
        step = self.run.scene.accuracy.step
        tolerance = self.run.stepper.control.tolerance if step is None else None
        made_by = radau(self.run.stepper.control.method.order)
        return EngineSettings(replace(made_by, tolerance=tolerance, step=step), "minimal")

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
        return forces

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
            *((spring.second.part, spring.first.part, pull) for spring, pull in self.pulls.items()),
            *((*self.force_parts[name], force) for name, force in self.forces.items()),
            *((*contact.parts, force) for contact, force in self.on_points),
        ]
        pushed = [
            *self.reactions.on_parts,
            *((first, force) for first, _, force in between),
            *((second, -force) for _, second, force in between),
        ]
        for part, force in pushed:
            if part != GROUND:
                given[part] += force
        return given


SAME_PART_OF_RUN = (
    1e-6  # of the run: where it ends, and where equations were found to have no answer
)


def prepare(
    scene: Scene,
    assembly: Assembly,
    progress: Callable[[float], None] | None,
    limits: float = 1.0,
    *,
    seed: bool = False,
) -> MinimalRun:
    """Build the tree, the loop and what records it; SceneError: it starts at a dead centre."""
    mechanism = assembly.mechanism
    layout = tree_layout(mechanism)
    end = end_of_run(scene, mechanism)
    events: list[Event] = []
    try:
        model = MinimalModel(assembly, layout, events, seed=seed)
    except DeadCentreError as error:
        hint = "it is a dead centre: start at another angle"
        raise SceneError(scene.document, [Mistake(("joints",), str(error), hint)]) from error
    accuracy = scene.accuracy
    smallest = 1e-3 * min(1.0, *(part.reach for part in mechanism.parts))
    control = ErrorControl(
        accuracy.tolerance or smallest,
        stages_for(mechanism.contacts_and_pairs),
        accuracy.step,
        limits,
        late=LATE * seed,
    )
    watched = Watched(scene, mechanism, assembly.state.q)
    seeker = ExtremeSeeker(watched, model.contacts.all, control.method.nodes)
    recorder = TreeRecorder(model, sample_times(scene, mechanism, end), seeker)
    goal = _goal(scene, assembly, layout)
    try:
        problem = MinimalProblem(model, recorder, goal, half_periods(assembly), end, accuracy.step)
    except LockedError as error:
        mistake = Mistake(
            ("joints", error.joint, error.key), f"{error}, as it starts", error.advice
        )
        raise SceneError(scene.document, [mistake]) from error
    stepper = ImplicitStepper(model, problem, control, error_times(mechanism, end), end)
    knots, leap = mechanism.knots(end), model.window.go_on
    leap(0.0, min(knots, default=inf))
    solution = Solution(
        stepper, problem, [*knots, end], progress, leap,
        lambda: model.coordinates.locked(stepper.at.kept.state),
    )  # fmt: skip
    return MinimalRun(scene, model, problem, stepper, solution, recorder, events)


def solve(run: MinimalRun) -> tuple[str, str]:
    """Integrate to the end; return what went wrong and what to try, empty if nothing."""
    complaint = "", ""
    with interrupts(run.solution.interrupt):
        try:
            run.solution.run()
            run.recorder.work_off()
        except DeadCentreError as error:
            complaint = str(error), LOCKED_ADVICE
        except NoConvergenceError as error:
            complaint = _no_convergence(run, error)
        except TROUBLES as error:  # such as of a drive, as it goes on past a knot, or at a sample
            complaint = str(error), error.advice
    if run.stepper.time < run.problem.end * (1 - 1e-9):
        run.recorder.keep_last()  # stopped early
    run.recorder.flush()
    return complaint


def _no_convergence(run: MinimalRun, error: NoConvergenceError) -> tuple[str, str]:
    """Say why no step is short enough, and what to try."""
    locked = run.model.coordinates.locked(run.stepper.at.kept.state)
    if locked:
        return locked, LOCKED_ADVICE
    tolerance, time = run.scene.accuracy.tolerance, run.stepper.time
    if run.model.trouble is not None:
        when, trouble = run.model.trouble
        if abs(when - time) < SAME_PART_OF_RUN * run.problem.end:
            return str(trouble), trouble.advice
    shortest = instant(time, EVENT_TIME)
    advice = no_solution_advice(run.model.assembly, tolerance, shortest, time)
    return f"{NO_SOLUTION} ({error})", advice


def finish(run: MinimalRun, complaint: tuple[str, str]) -> Result:
    """Put the Result together; its timings are still to come."""
    at_once = passed_on(run.problem.impacts.together, "all of them at once")
    halves = [run.problem.half_periods[k] for k in run.model.touches.ever]
    short = shortened(run.problem.given, [(half, FIRST * half) for half in halves])
    doubtful = *_slipped(run), *_on_dead_centres(run)
    warnings = (*short, *doubtful, *at_once, *run.solution.creeps)
    return RunReader(run).result(warnings, _outcome(run, *complaint))


def _slipped(run: MinimalRun) -> list[str]:
    """Say where the user's own step was too long for what follows other coordinates, or a motor."""
    slips = run.stepper.slips
    if not slips:
        return []
    time, step, slip = max(slips, key=lambda record: record[2])
    return [
        f"a step of {step:.3g} s is too long from {time:.4g} s on: what a loop, a slot or a drive "
        f"moves ended it {slip:.2g} m from where its speed takes it; so did {len(slips)} of "
        f"{run.stepper.steps} steps; shorten the step, or ask for a tolerance"
    ]


def _on_dead_centres(run: MinimalRun) -> list[str]:
    """Say where a loop passed a dead centre so closely that rounding decided on errors."""
    rounded, given = run.stepper.rounded, run.scene.accuracy.step
    if not rounded:
        return []
    limit = "the tolerance" if given is None else "the step"
    return [
        f"a loop of joints passed a dead centre at {rounded[0]:.4g} s: near it rounding decides on "
        f"errors, not {limit}; compare with a run at another one"
    ]


def _goal(
    scene: Scene, assembly: Assembly, layout: TreeLayout
) -> Callable[[FloatArray], float] | None:
    """Angle still to turn, of all coordinates of the tree; None where time ends the run."""
    goal = turn_goal(scene, assembly)
    if goal is None:
        return None
    row = layout.turning_row(goal.first, goal.second)
    start = goal.start - layout.turn(goal.first, goal.second)

    def left(x: FloatArray) -> float:
        return goal.turned - abs(float(row @ x) - start)

    return left


def _outcome(run: MinimalRun, complaint: str, advice: str) -> Outcome:
    problem = run.problem
    reasons = (
        (INTERRUPTED if run.solution.interrupted else "", ""),
        (problem.stop_reason, problem.stop_advice),
        (problem.bounds.passed(run.recorder.seeker.deepest), TOO_DEEP_ADVICE),  # within a step
        (complaint, advice),
    )
    mechanism = run.model.assembly.mechanism
    return outcome_of(run.scene, mechanism, run.stepper.time, problem.left, reasons)
