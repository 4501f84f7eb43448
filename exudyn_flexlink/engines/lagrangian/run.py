"""Run a scene by the hand-written equations of motion.

A scene's `accuracy.tolerance` is the error that the whole run may make in positions, m. An implicit
method of order 9 in machine code keeps it (see `advance`), or SciPy's explicit DOP853, as the scene
asks; where speeds jump, the explicit one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from threading import Event as Asked
from time import perf_counter

import numpy as np

from exudyn_flexlink.engines import Compilation
from exudyn_flexlink.engines.coasting import coasting, keeping
from exudyn_flexlink.engines.diagnostics.walls import resolving
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.interrupts import interrupts
from exudyn_flexlink.engines.lagrangian.addresses import equations_with, kind_of, steps_with
from exudyn_flexlink.engines.lagrangian.advance import advance
from exudyn_flexlink.engines.lagrangian.compiled import (
    compilation,
    hearing_interrupts,
    one_at_a_time,
    seldom_collecting,
)
from exudyn_flexlink.engines.lagrangian.compiled_stepper import CompiledStepper
from exudyn_flexlink.engines.lagrangian.instability import Instability
from exudyn_flexlink.engines.lagrangian.mass import mass_matrix
from exudyn_flexlink.engines.lagrangian.model import Model, build_model
from exudyn_flexlink.engines.lagrangian.outcome import Prepared, finish
from exudyn_flexlink.engines.lagrangian.parallel_compiling import compile_in_parallel
from exudyn_flexlink.engines.lagrangian.problem import LagrangianProblem
from exudyn_flexlink.engines.lagrangian.recording import Recorder
from exudyn_flexlink.engines.lagrangian.sampling import motions_at
from exudyn_flexlink.engines.lagrangian.step_control import Control
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import RADAU
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.explicit import ExplicitStepper
from exudyn_flexlink.integrate.problem import NoConvergenceError
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import Mechanism, end_of_run, sample_times, turn_goal
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

# Measured over the shipped scenes without clearance, tolerances from 1e-3 to 1e-8 m: over two turns
# the error of S and of the tip is 0.02 to 0.8 of the tolerance, where that limits the steps.
SHARE = 0.2  # of the tolerance: error that one step may make
# The same with walls, where a touch multiplies errors.
WALLED_SHARE = 0.02
JUST_AHEAD = 1e-9  # s: where no step is short enough, what is wrong is as near as this
IMPLICIT_TURN = 0.4  # rad of the guide in one implicit step: Newton's method for P stays local
EXPLICIT_NODES = np.array([0.0, 0.5, 1.0])  # at which an explicit step is looked at for extremes
WITHOUT_TOLERANCE = 1e-7  # m: where the scene gives a step, of which the Lagrangian has no use


def run(scene: Scene, progress: Callable[[float], None] | None = None) -> Result:
    """Simulate a scene; a run that fails is a Result with ``outcome.completed`` False.

    Raises:
        NotRepresentableError: the scene is not one guide, its link, and levers.
        SceneError: the scene can't be put together.

    """
    began = perf_counter()
    prepared = prepare(scene, progress)
    timings = {"prepare": perf_counter() - began}
    by_explicit = isinstance(prepared.stepper, ExplicitStepper)
    if _compilation(prepared.model.mechanism, by_explicit) != "none":
        began = perf_counter()
        with one_at_a_time():
            _compile(prepared)
        timings["compile"] = perf_counter() - began
    began = perf_counter()
    complaint = solve(prepared)
    timings["solve"] = perf_counter() - began
    began = perf_counter()
    result = finish(prepared, complaint)
    return replace(result, timings={**timings, "process": perf_counter() - began})


def prepare(scene: Scene, progress: Callable[[float], None] | None = None) -> Prepared:
    """Build the equations, the event loop and what records it."""
    assembly = assemble_scene(scene)
    model = build_model(scene, assembly)
    end = end_of_run(scene, assembly.mechanism)
    system = System(model, turn_goal(scene, assembly))
    mechanism, by_explicit = assembly.mechanism, explicit(scene, assembly.mechanism)
    nodes = EXPLICIT_NODES if by_explicit else np.array([0.0, *RADAU.nodes])
    watched = Watched(scene, mechanism, assembly.state.q)
    seeker = ExtremeSeeker(watched, mechanism.contacts, nodes)
    recorder = Recorder(system, sample_times(scene, mechanism, end), seeker, by_explicit)
    problem = LagrangianProblem(system, recorder, Instability(system, end))
    tolerance = resolving(scene.accuracy.tolerance or WITHOUT_TOLERANCE, mechanism)
    stepper: CompiledStepper | ExplicitStepper
    if by_explicit:
        stepper = ExplicitStepper(problem, tolerance)
    else:
        stepper = CompiledStepper(problem, control(model, tolerance, end))
    asked = Asked()
    solution = Solution(stepper, problem, [*mechanism.knots(end), end], progress, asked.is_set)
    return Prepared(scene, model, system, recorder, problem, stepper, solution, asked, tolerance)


def explicit(scene: Scene, mechanism: Mechanism) -> bool:
    """Tell whether SciPy's explicit method is to solve a scene."""
    asked = scene.solver.integrator == "dop853" or scene.accuracy.tolerance is None
    return asked or not_smooth(mechanism)


def compiles(scene: Scene) -> Compilation:
    """Tell whether a run will begin by compiling equations and their method.

    That takes up to half a minute. If so, whether the code is then kept for later runs.

    Raises:
        SceneError: the scene can't be put together.

    """
    mechanism = assemble_scene(scene).mechanism
    return _compilation(mechanism, explicit(scene, mechanism))


def _compilation(mechanism: Mechanism, by_explicit: bool) -> Compilation:
    kind = kind_of(mechanism)
    steps = [] if by_explicit else [advance, *steps_with(kind)]
    return compilation(motions_at, *equations_with(kind), *steps)


def _compile(prepared: Prepared) -> None:
    """Have everything compiled that steps, events and samples are made by."""
    system, stepper = prepared.system, prepared.stepper
    if isinstance(stepper, CompiledStepper):
        compile_in_parallel(system.kind)
    with seldom_collecting(), hearing_interrupts():
        if isinstance(stepper, CompiledStepper):
            stepper.compile()
        else:
            system.rate(0.0, system.start)
        q, v, point = system.coordinates(0.0, system.start)
        system.motion(0.0, system.start)
        system.point_event_functions(0.0, system.start)
        if not_smooth(prepared.model.mechanism):
            mass_matrix(q, point, system.constants)
        for walls in system.walls:
            walls.compile(q, v, point)


def not_smooth(mechanism: Mechanism) -> bool:
    """Tell whether speeds jump, where the implicit method is no use.

    Bounces that get lower and lower need errors small against the bounce, not against a length.
    """
    return any(isinstance(contact.law, Impulse) for contact in mechanism.contacts)


def control(model: Model, tolerance: float, end: float) -> Control:
    """Error of one step so that the whole run, to `end` (s), keeps the tolerance (m)."""
    reaches = np.zeros(model.layout.count)
    for pivot in (model.layout.guide, *model.layout.levers):
        part = model.mechanism.parts[pivot.part]
        reaches[model.layout.coordinate(pivot.part)] = part.reach
    tau = coasting(model.mechanism, end)
    # An error a of the acceleration moves a driven mechanism by a tau^2, as it swings; one that
    # goes on as it was pushed by a end^2.
    lasts = end if model.layout.motor is None else tau
    channels = model.mechanism.channels
    share = tolerance * (WALLED_SHARE if channels else SHARE)
    lasting = max(tau, keeping(model.mechanism, end))
    return Control(share, tau, lasting, IMPLICIT_TURN, reaches, share / lasts**2)


def solve(prepared: Prepared) -> str:
    """Integrate to the end; return what went wrong, empty if nothing."""
    system, problem, recorder = prepared.system, prepared.problem, prepared.recorder
    complaint = ""
    with interrupts(prepared.asked.set):
        try:
            prepared.solution.run()
        except DeadCentreError as error:
            complaint = str(error)
        except NoConvergenceError as error:
            complaint = _dead_centre(system, problem) or (
                f"no step is short enough ({error}{_last(problem)})"
            )
    recorder.keep_last(problem.time, problem.state)
    recorder.flush()
    return complaint


def _dead_centre(system: System, problem: LagrangianProblem) -> str:
    """Say that P can't be found in a trial step, or just ahead; empty if it can."""
    try:
        system.coordinates(problem.time + JUST_AHEAD, problem.state)
    except DeadCentreError as error:
        return str(error)
    return system.trouble


def _last(problem: LagrangianProblem) -> str:
    """Name what happened last, where that was at the instant at which the run stands still."""
    event = problem.system.events[-1] if problem.system.events else None
    if event is None or problem.time - event.time > instant(problem.time, EVENT_TIME):
        return ""
    return f"; the last was '{event.kind}' of '{event.name}'"
