"""Run a scene as a tree of links: minimal coordinates, error-controlled Radau steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.exudyn.minimal.collocation import C
from exudyn_flexlink.engines.exudyn.minimal.control import ErrorControl
from exudyn_flexlink.engines.exudyn.minimal.loop import MinimalLoop
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.outcome import MinimalRun, report
from exudyn_flexlink.engines.exudyn.minimal.recording import Recorder
from exudyn_flexlink.engines.exudyn.minimal.stepper import IN_CONTACT
from exudyn_flexlink.engines.exudyn.redundant.pace import shortened
from exudyn_flexlink.engines.exudyn.reporting import result_of, turns_missing
from exudyn_flexlink.engines.interrupts import interrupts
from exudyn_flexlink.mechanism import (
    Assembly,
    Mechanism,
    cut_short,
    end_of_run,
    half_period,
    sample_times,
    turn_goal,
)
from exudyn_flexlink.mechanism.tree import NotMinimalError, TreeLayout, tree_layout
from exudyn_flexlink.result import INTERRUPTED, Event, Outcome, Result
from exudyn_flexlink.scene import Scene

FloatArray = NDArray[np.float64]


def prepare(
    scene: Scene,
    assembly: Assembly,
    progress: Callable[[float], None] | None,
) -> MinimalRun:
    """Build the tree, the loop and what records it.

    Raises:
        NotRepresentableError: the mechanism is no tree.

    """
    mechanism = assembly.mechanism
    try:
        layout = tree_layout(mechanism)
    except NotMinimalError as error:
        raise NotRepresentableError(error.path, error.message) from error
    end = end_of_run(scene, mechanism)
    events: list[Event] = []
    model = MinimalModel(assembly, layout, events)
    seeker = ExtremeSeeker(scene, mechanism, mechanism.contacts, np.array([0.0, *C]))
    recorder = Recorder(model, sample_times(scene, mechanism, end), seeker)
    accuracy = scene.accuracy
    halves = [half_period(assembly, contact) for contact in mechanism.contacts]
    smallest = 1e-3 * min(1.0, *(part.reach for part in mechanism.parts))
    loop = MinimalLoop(
        model,
        ErrorControl(accuracy.tolerance or smallest, accuracy.step),
        recorder,
        end,
        [t for t in _bends(mechanism) if 0 < t < end],
        halves,
        _goal(scene, assembly, layout),
        progress,
    )
    return MinimalRun(scene, model, loop, recorder, events)


def solve(run: MinimalRun) -> tuple[str, str]:
    """Integrate to the end; return what went wrong and what to try, empty if nothing."""
    with interrupts(run.loop.interrupt):
        complaint = run.loop.run()
    run.recorder.flush()
    return complaint


def finish(run: MinimalRun, complaint: tuple[str, str]) -> Result:
    """Put the Result together; its timings are still to come."""
    found = report(run)
    mechanism = run.model.assembly.mechanism
    outcome = _outcome(run, *complaint)
    told = [*_shortened(run), *_on_dead_centres(run)]
    return result_of(run.scene, mechanism, found, told, outcome)


def _shortened(run: MinimalRun) -> list[str]:
    """Say where the user's own step was too long for a contact that came to be."""
    given, halves = run.loop.control.fixed, run.loop.half_periods
    touched = {entry.index for entry in run.loop.entries}
    if given is None:
        return []
    found = [halves[k] for k in touched if IN_CONTACT * halves[k] < given]
    return [shortened(given, min(found), IN_CONTACT * min(found))] if found else []


def _on_dead_centres(run: MinimalRun) -> list[str]:
    """Say where a loop passed a dead centre so closely that rounding decided on errors."""
    found = run.loop.rounded
    if not found:
        return []
    return [
        f"a loop of joints passed a dead centre at {found[0]:.4g} s: near it rounding decides on "
        "errors, not the tolerance; compare with a run at another one"
    ]


def _bends(mechanism: Mechanism) -> list[float]:
    """Instants at which drives reach their values: derivatives jump there."""
    motors = (*mechanism.speed_motors, *mechanism.torque_motors)
    return sorted({motor.ramp.duration for motor in motors})


def _goal(
    scene: Scene, assembly: Assembly, layout: TreeLayout
) -> Callable[[FloatArray], float] | None:
    """Angle still to turn, of all coordinates of the tree; None where time ends the run."""
    goal = turn_goal(scene, assembly)
    if goal is None:
        return None
    row = layout.turning_row(goal.first, goal.second)
    start = goal.start - layout.turn(goal.second) + layout.turn(goal.first)

    def left(x: FloatArray) -> float:
        turned = float(row @ x) - start
        return abs(goal.turned) - (turned if goal.turned > 0 else -turned)

    return left


def _outcome(run: MinimalRun, complaint: str, advice: str) -> Outcome:
    loop = run.loop
    if loop.interrupted:
        return Outcome(False, loop.time, INTERRUPTED)
    if loop.stop_reason:
        return Outcome(False, loop.time, loop.stop_reason, loop.stop_advice)
    if complaint:
        return Outcome(False, loop.time, complaint, advice)
    missing = not loop.reached if loop.goal is not None else cut_short(
        run.scene, run.model.assembly.mechanism
    )  # fmt: skip
    if missing:
        return Outcome(False, loop.time, *turns_missing(run.scene.run.of))
    return Outcome(True, loop.time)
