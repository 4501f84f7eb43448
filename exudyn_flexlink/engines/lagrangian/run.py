"""Run a scene by the hand-written equations of motion.

A scene's `accuracy.tolerance` (m) is the error that the whole run may make in positions. The
implicit method of order 9 or 13 keeps it, or SciPy's explicit DOP853 if the scene asks for it. If
speeds jump, the explicit method is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from exudyn_flexlink.engines.diagnostics import passed_on
from exudyn_flexlink.engines.finer import LATE
from exudyn_flexlink.engines.interrupts import TOO_DEEP_ADVICE, interrupts, outcome_of, radau, timed
from exudyn_flexlink.engines.lagrangian.model import Model, build_model
from exudyn_flexlink.engines.lagrangian.problem import Forces, Problem, Recorder
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.engines.recording import Histories
from exudyn_flexlink.engines.touching import ExtremeSeeker, error_times
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.explicit import ExplicitStepper
from exudyn_flexlink.integrate.problem import NoConvergenceError, order_of, stages_for
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.integrate.stepper import ErrorControl, ImplicitStepper
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import Mechanism, end_of_run, sample_times, turn_goal
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import INTERRUPTED, EngineSettings, Event, Integrator, Outcome, Result
from exudyn_flexlink.scene import Scene

PACKAGES = "scipy", "numpy"
DOP853 = Integrator("DOP853", 8)
WITHOUT_TOLERANCE = 1e-7  # m: for scenes that give a step instead; this engine has no fixed steps
TIGHTEN = "tighten the tolerance, since more energy is missing than there is; then "
ADVICE = (
    "look at the mechanism there: the guide's axis may touch the track (a dead centre), or a "
    "contact be too stiff"
)


@dataclass
class Prepared:
    """All objects that a solve reads and changes."""

    scene: Scene
    model: Model
    system: System
    problem: Problem
    solution: Solution
    laps: list[Event]
    tolerance: float  # m: error in positions that the run may make


def order(scene: Scene) -> int:
    """Return the order of the method that solves a scene."""
    mechanism = assemble_scene(scene).mechanism
    if explicit(scene, mechanism):
        return DOP853.order
    return order_of(stages_for(mechanism.contacts_and_pairs, scene.accuracy.tolerance))


def run(
    scene: Scene,
    progress: Callable[[float], None] | None = None,
    limits: float = 1.0,
    *,
    seed: bool = False,
) -> Result:
    """Simulate a scene; a run that fails is a Result with ``outcome.completed`` False.

    Limits of steps, except that by their error, are `limits` times as long as usual. With `seed`
    the start is changed by a rounding error: see `finer`.

    Raises:
        NotRepresentableError: the scene is not one guide, its link, and levers.
        SceneError: the scene can't be put together.

    """
    return timed(lambda: prepare(scene, progress, limits, seed=seed), solve, finish)


def prepare(
    scene: Scene,
    progress: Callable[[float], None] | None = None,
    limits: float = 1.0,
    *,
    seed: bool = False,
) -> Prepared:
    """Build the equations, the events, the recorder and the stepper."""
    assembly = assemble_scene(scene)
    mechanism, model = assembly.mechanism, build_model(scene, assembly)
    end, laps = end_of_run(scene, mechanism), list[Event]()
    system = System(model, laps)
    watched = Watched(scene, mechanism, assembly.state.q)
    tolerance = scene.accuracy.tolerance or WITHOUT_TOLERANCE
    stages = stages_for(mechanism.contacts_and_pairs, scene.accuracy.tolerance)
    control = ErrorControl(tolerance, stages, limits=limits, late=LATE * seed)
    seeker = ExtremeSeeker(watched, system.contacts.all, control.method.nodes)
    recorder = Recorder(system, sample_times(scene, mechanism, end), seeker)
    goal = turn_goal(scene, assembly)
    goes_on = bool(scene.initial.states)
    problem = Problem(system, recorder, goal, end, goes_on=goes_on)
    if seed:
        problem.start_off()
    stepper: ImplicitStepper | ExplicitStepper
    if explicit(scene, mechanism):
        stepper = ExplicitStepper(problem, tolerance, limits, control.late)
    else:
        stepper = ImplicitStepper(system, problem, control, error_times(mechanism, end), end)
    solution = Solution(stepper, problem, [*mechanism.knots(end), end], progress)
    return Prepared(scene, model, system, problem, solution, laps, tolerance)


def explicit(scene: Scene, mechanism: Mechanism) -> bool:
    """Tell whether SciPy's explicit method solves a scene: on demand, or because speeds jump.

    Bounces get lower and lower; their errors must be small against the bounce, not a length.
    """
    asked = scene.solver.integrator == "dop853" or scene.accuracy.tolerance is None
    return asked or any(isinstance(contact.law, Impulse) for contact in mechanism.touching)


def solve(prepared: Prepared) -> str:
    """Integrate to the end; return what failed, empty if nothing did."""
    problem, recorder = prepared.problem, prepared.problem.recorder
    complaint = ""
    with interrupts(prepared.solution.interrupt):
        try:
            prepared.solution.run()
        except DeadCentreError as error:
            complaint = str(error)
        except NoConvergenceError as error:
            complaint = prepared.system.dead_centre or f"no step is short enough ({error})"
    if problem.time < prepared.solution.end * (1 - 1e-9):
        recorder.keep_last()
    recorder.flush()
    return complaint


def finish(prepared: Prepared, complaint: str) -> Result:
    """Make the Result; versions and timings are added later."""
    recorder, model = prepared.problem.recorder, prepared.model
    kept = recorder.all_kept()
    forces = Forces(model, kept)
    stepper = prepared.solution.stepper
    made_by = (
        DOP853 if isinstance(stepper, ExplicitStepper) else radau(stepper.control.method.order)
    )
    places = prepared.problem.seen.place
    histories = Histories(
        prepared.scene, prepared.solution.stepper, recorder, kept, *recorder.motion(kept), places
    )
    return histories.result(
        prepared.laps,
        forces.joints(),
        engine="lagrangian",
        settings=EngineSettings(replace(made_by, tolerance=prepared.tolerance)),
        drive_torques=forces.drive_torques(),
        drive_forces={},
        slot_forces={slot.name: forces.slot for slot in model.mechanism.slots},
        warnings=(
            *passed_on(prepared.problem.impacts.together, "each in turn"),
            *prepared.solution.creeps,
        ),
        outcome=_outcome(prepared, complaint),
    )


def _outcome(prepared: Prepared, complaint: str) -> Outcome:
    problem, recorder = prepared.problem, prepared.problem.recorder
    gross = recorder.energy_residual > recorder.largest_kinetic_energy
    reasons = (
        (INTERRUPTED if prepared.solution.interrupted else "", ""),
        (problem.stop_reason, problem.stop_advice),
        (problem.bounds.passed(recorder.seeker.deepest), TOO_DEEP_ADVICE),  # within a step
        (complaint, f"{TIGHTEN}{ADVICE}" if gross else ADVICE),
    )
    return outcome_of(prepared.scene, prepared.model.mechanism, problem.time, problem.left, reasons)
