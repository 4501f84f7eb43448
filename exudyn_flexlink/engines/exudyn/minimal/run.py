"""Runs of a scene as a tree of links, in minimal coordinates, with error-controlled Radau steps.

After the solve the tree's motion becomes a Result: poses, reactions, events, checks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics import passed_on, shortened
from exudyn_flexlink.engines.exudyn.engine import LOCKED_ADVICE, NO_SOLUTION, no_solution_advice
from exudyn_flexlink.engines.exudyn.minimal.friction import LockedError
from exudyn_flexlink.engines.exudyn.minimal.model import TROUBLES, MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.problem import MinimalProblem
from exudyn_flexlink.engines.exudyn.minimal.reactions import JointForces, JointImpulses
from exudyn_flexlink.engines.exudyn.minimal.recording import TreeKept, TreeRecorder
from exudyn_flexlink.engines.finer import LATE
from exudyn_flexlink.engines.interrupts import TOO_DEEP_ADVICE, interrupts, outcome_of, radau
from exudyn_flexlink.engines.recording import Histories
from exudyn_flexlink.engines.touching import FIRST, ExtremeSeeker, error_times
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.expressions import NoValueError
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.problem import NoConvergenceError, instant, stages_for
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.integrate.stepper import ErrorControl, ImplicitStepper
from exudyn_flexlink.mechanism import (
    Assembly,
    end_of_run,
    half_periods,
    pressing_at_start,
    sample_times,
    turn_goal,
)
from exudyn_flexlink.mechanism.tree import TreeLayout, tree_layout
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import (
    INTERRUPTED,
    EngineSettings,
    Event,
    JumpHistory,
    Outcome,
    Result,
)
from exudyn_flexlink.scene import PointsJoint, Scene
from exudyn_flexlink.source import Mistake, SceneError


@dataclass
class MinimalRun:
    """The objects of a run of a tree."""

    scene: Scene
    model: MinimalModel
    problem: MinimalProblem
    stepper: ImplicitStepper
    solution: Solution
    recorder: TreeRecorder
    events: list[Event]


class TreeRunReader:
    """Makes the Result from the records of a run."""

    def __init__(self, run: MinimalRun) -> None:
        self.run, self.mechanism = run, run.model.assembly.mechanism
        self.kept = run.recorder.all_kept()
        self.held = JointForces(run.model, run.recorder.contacts, self.kept)

    def result(self, warnings: tuple[str, ...], outcome: Outcome) -> Result:
        """Return the Result; versions and timings are added later."""
        points = [n for n, joint in self.run.scene.joints.items() if isinstance(joint, PointsJoint)]
        run, poses, rates = self.run, self.held.moved.poses, self.held.moved.rates
        kept: TreeKept = self.kept.of_engine
        histories = Histories(
            run.scene, run.stepper, run.recorder, self.kept, poses, rates, run.problem.places
        )
        return histories.result(
            run.events,
            self.held.in_joints(points),
            gears=self.held.reactions.gears,
            frictions=(kept.rests, kept.friction),
            joint_impulses=self._impulses(points),
            engine="exudyn",
            settings=self._settings(),
            drive_torques=self.held.torques(),
            drive_forces=self.held.forces,
            slot_forces={s.name: self.held.reactions.forces[s.name] for s in self.mechanism.slots},
            warnings=warnings,
            outcome=outcome,
        )

    def _impulses(self, points: list[str]) -> dict[str, JumpHistory]:
        """Impulses in joints of two points and in slots, by name, if speeds jump anywhere."""
        leaps = self.run.recorder.leaps()
        if leaps is None:
            return {}
        jumps = JointImpulses(self.run.model, self.run.recorder.contacts, leaps)
        impulses = jumps.in_joints(points)
        impulses |= {s.name: jumps.reactions.forces[s.name] for s in self.mechanism.slots}
        return {name: JumpHistory(leaps.t, values) for name, values in impulses.items()}

    def _settings(self) -> EngineSettings:
        step = self.run.scene.accuracy.step
        tolerance = self.run.stepper.control.tolerance if step is None else None
        made_by = radau(self.run.stepper.control.method.order)
        return EngineSettings(replace(made_by, tolerance=tolerance, step=step), "minimal")


SAME_PART_OF_RUN = 1e-6  # of the run: instants nearer than this count as the same


def prepare(
    scene: Scene,
    assembly: Assembly,
    progress: Callable[[float], None] | None,
    limits: float = 1.0,
    *,
    seed: bool = False,
) -> MinimalRun:
    """Build the tree, the loop and the recorder; SceneError at a dead centre or an early end."""
    mechanism = assembly.mechanism
    opened = replace(assembly, mechanism=mechanism.opened())
    layout = tree_layout(opened.mechanism)
    end = end_of_run(scene, mechanism)
    events: list[Event] = []
    try:
        model = MinimalModel(opened, layout, events, seed=seed)
    except DeadCentreError as error:
        hint = "it is a dead centre: start at another angle"
        raise SceneError(scene.document, [Mistake(("joints",), str(error), hint)]) from error
    accuracy = scene.accuracy
    smallest = 1e-3 * min(1.0, *(part.reach for part in mechanism.parts))
    control = ErrorControl(
        accuracy.tolerance or smallest,
        stages_for(mechanism.contacts_and_pairs, accuracy.tolerance),
        accuracy.step,
        limits,
        late=LATE * seed,
    )
    watched = Watched(scene, mechanism, assembly.state.q)
    seeker = ExtremeSeeker(watched, model.contacts.all, control.method.nodes)
    recorder = TreeRecorder(model, sample_times(scene, mechanism, end), seeker)
    goal = _goal(scene, assembly, layout)
    goes_on, path = bool(scene.initial.states), scene.ending[0]
    try:
        problem = MinimalProblem(
            model, recorder, goal, half_periods(assembly), end, accuracy.step,
            pressing_at_start(scene, mechanism), goes_on,
        )  # fmt: skip
        asked = None if seed or goes_on else problem.until
        ended = asked.mistakes(path) if asked else []
    except LockedError as error:
        mistake = Mistake(
            ("joints", error.joint, error.key), f"{error}, as it starts", error.advice
        )
        raise SceneError(scene.document, [mistake]) from error
    except NoValueError as error:
        ended = [Mistake(path, str(error), error.advice)]
    if ended:
        raise SceneError(scene.document, ended)
    stepper = ImplicitStepper(model, problem, control, error_times(mechanism, end), end)
    knots, leap = mechanism.knots(end), model.window.go_on
    leap(0.0, min(knots, default=inf))
    solution = Solution(
        stepper, problem, [*knots, end], progress, leap,
        lambda: model.coordinates.locked(stepper.at.kept.state),
    )  # fmt: skip
    return MinimalRun(scene, model, problem, stepper, solution, recorder, events)


def solve(run: MinimalRun) -> tuple[str, str]:
    """Integrate to the end; return a complaint and an advice, empty after success."""
    complaint = "", ""
    with interrupts(run.solution.interrupt):
        try:
            run.solution.run()
            run.recorder.record_waiting()
        except DeadCentreError as error:
            complaint = str(error), LOCKED_ADVICE
        except NoConvergenceError as error:
            complaint = _no_convergence(run, error)
        except TROUBLES as error:  # such as a drive without a value, beyond a knot or at a sample
            complaint = str(error), error.advice
    if run.problem.came:
        run.recorder.keep_end(run.stepper.time)
    elif run.stepper.time < run.problem.end * (1 - 1e-9):
        run.recorder.keep_last()  # stopped early
    run.recorder.flush()
    return complaint


def _no_convergence(run: MinimalRun, error: NoConvergenceError) -> tuple[str, str]:
    """Reason for which no step is short enough, and an advice."""
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
    """Make the Result; timings are added later."""
    at_once = passed_on(run.problem.impacts.together, "all of them at once")
    halves = [run.problem.half_periods[k] for k in run.model.touches.ever]
    short = shortened(run.problem.given, [(half, FIRST * half) for half in halves])
    doubtful = *_slipped(run), *_on_dead_centres(run), *_waited(run)
    warnings = (*short, *doubtful, *at_once, *run.solution.creeps)
    return TreeRunReader(run).result(warnings, _outcome(run, *complaint))


def _slipped(run: MinimalRun) -> list[str]:
    """Warn if the user's step was too long for dependent coordinates."""
    slips = run.stepper.slips
    if not slips:
        return []
    time, step, slip = max(slips, key=lambda record: record[2])
    return [
        f"a step of {step:.3g} s is too long from {time:.4g} s on: what a loop, a slot or a drive "
        f"moves ended it {slip:.2g} m from where its speed takes it; so did {len(slips)} of "
        f"{run.stepper.steps} steps; shorten the step, or ask for a tolerance"
    ]


def _waited(run: MinimalRun) -> list[str]:
    """Warn if the formula of `until` was not below zero at the start of the run or stage."""
    if run.problem.until is None or not run.problem.until.waited:
        return []
    begin = f"'until' is not below 0 as the run goes on at {run.scene.initial.clock:.6g} s"
    return [f"{begin}: it counts once it has been"]


def _on_dead_centres(run: MinimalRun) -> list[str]:
    """Warn if a loop passed a dead centre so closely that rounding determined the error."""
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
    """Angle still to turn as a function of the tree's coordinates; None if time ends the run."""
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
    outcome = outcome_of(run.scene, mechanism, run.stepper.time, problem.left, reasons)
    return replace(outcome, until=problem.came if problem.until else None)
