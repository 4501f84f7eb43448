"""Run a scene as a tree of links: minimal coordinates, error-controlled Radau steps."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.coasting import error_times
from exudyn_flexlink.engines.diagnostics.bouncing import passed_on
from exudyn_flexlink.engines.diagnostics.contacts import shortened
from exudyn_flexlink.engines.ending import TOO_DEEP_ADVICE, outcome_of
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.exudyn.minimal.friction import LockedError
from exudyn_flexlink.engines.exudyn.minimal.model import TROUBLES, MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.outcome import MinimalRun, RunReader
from exudyn_flexlink.engines.exudyn.minimal.problem import MinimalProblem
from exudyn_flexlink.engines.exudyn.minimal.recording import Recorder
from exudyn_flexlink.engines.exudyn.reporting import LOCKED_ADVICE, NO_SOLUTION, no_solution_advice
from exudyn_flexlink.engines.interrupts import interrupts
from exudyn_flexlink.engines.seeding import LATE
from exudyn_flexlink.engines.touching import FIRST
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import C
from exudyn_flexlink.integrate.control import ErrorControl
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.problem import NoConvergenceError
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.integrate.stepper import ImplicitStepper
from exudyn_flexlink.mechanism import Assembly, end_of_run, half_periods, sample_times, turn_goal
from exudyn_flexlink.mechanism.tree import TreeLayout, tree_layout
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import INTERRUPTED, Event, Outcome, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import Mistake, SceneError

NEAR = 1e-6  # of the run: where it ends, and where equations were found to have no answer


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
    contacts = [*mechanism.touching, *model.walls.contacts]
    watched = Watched(scene, mechanism, assembly.state.q)
    seeker = ExtremeSeeker(watched, contacts, np.array([0.0, *C]))
    recorder = Recorder(model, sample_times(scene, mechanism, end), seeker)
    accuracy = scene.accuracy
    smallest = 1e-3 * min(1.0, *(part.reach for part in mechanism.parts))
    goal = _goal(scene, assembly, layout)
    try:
        problem = MinimalProblem(model, recorder, goal, half_periods(assembly), end, accuracy.step)
    except LockedError as error:
        own = Mistake(("joints", error.joint, "friction"), f"{error}, as it starts", error.advice)
        raise SceneError(scene.document, [own]) from error
    control = ErrorControl(accuracy.tolerance or smallest, accuracy.step, limits, late=LATE * seed)
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
        if abs(when - time) < NEAR * run.problem.end:
            return str(trouble), trouble.advice
    shortest = instant(time, EVENT_TIME)
    advice = no_solution_advice(run.model.assembly, tolerance, shortest, time)
    return f"{NO_SOLUTION} ({error})", advice


def finish(run: MinimalRun, complaint: tuple[str, str]) -> Result:
    """Put the Result together; its timings are still to come."""
    at_once = passed_on(run.problem.impacts.together, "all of them at once")
    halves = [run.problem.half_periods[k] for k in run.model.touches.ever]
    short = shortened(run.problem.given, [(half, FIRST * half) for half in halves])
    told = (*short, *_slipped(run), *_on_dead_centres(run), *at_once, *run.solution.creeps)
    return RunReader(run).result(told, _outcome(run, *complaint))


def _slipped(run: MinimalRun) -> list[str]:
    """Say where the user's own step was too long for what follows other coordinates, or a motor."""
    found = run.stepper.slips
    if not found:
        return []
    time, step, slip = max(found, key=lambda one: one[2])
    return [
        f"a step of {step:.3g} s is too long from {time:.4g} s on: what a loop, a slot or a drive "
        f"moves ended it {slip:.2g} m from where its speed takes it; so did {len(found)} of "
        f"{run.stepper.steps} steps; shorten the step, or ask for a tolerance"
    ]


def _on_dead_centres(run: MinimalRun) -> list[str]:
    """Say where a loop passed a dead centre so closely that rounding decided on errors."""
    found, given = run.stepper.rounded, run.scene.accuracy.step
    if not found:
        return []
    limit = "the tolerance" if given is None else "the step"
    return [
        f"a loop of joints passed a dead centre at {found[0]:.4g} s: near it rounding decides on "
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
