"""After the solve: samples to a Result, with its events, checks, warnings and how it ended."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from platform import python_version
from threading import Event as Asked

import numpy as np
import scipy

from exudyn_flexlink.engines.diagnostics.bouncing import passed_on
from exudyn_flexlink.engines.ending import checks, of_turns
from exudyn_flexlink.engines.lagrangian.compiled import version
from exudyn_flexlink.engines.lagrangian.compiled_stepper import CompiledStepper
from exudyn_flexlink.engines.lagrangian.forces import Forces
from exudyn_flexlink.engines.lagrangian.model import Model
from exudyn_flexlink.engines.lagrangian.problem import LagrangianProblem
from exudyn_flexlink.engines.lagrangian.recording import Recorder
from exudyn_flexlink.engines.lagrangian.sampling import Motions
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.engines.lagrangian.walls import PRESS
from exudyn_flexlink.integrate.explicit import ExplicitStepper
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.intervals import Interval, Intervals
from exudyn_flexlink.mechanism import approach
from exudyn_flexlink.result import (
    INTERRUPTED,
    Checks,
    ContactHistory,
    EnergyHistory,
    Outcome,
    Result,
    SleeveHistory,
)
from exudyn_flexlink.scene import Scene

TIGHTEN = "tighten the tolerance, since more energy is missing than there is; then "
ADVICE = (
    "look at the mechanism there: the guide's axis may touch the track (a dead centre), or a "
    "contact be too stiff"
)


@dataclass
class Prepared:
    """Everything a solve needs, and what is left of it afterwards."""

    scene: Scene
    model: Model
    system: System
    recorder: Recorder
    problem: LagrangianProblem
    stepper: CompiledStepper | ExplicitStepper
    solution: Solution
    asked: Asked  # whether the user asked to stop
    tolerance: float  # m: error in positions that the run may make


def finish(prepared: Prepared, complaint: str) -> Result:
    """Put the Result together; its timings are still to come."""
    recorder, model = prepared.recorder, prepared.model
    kept = recorder.samples
    time = np.array(kept.time)
    motion = Motions(*map(np.concatenate, zip(*kept.motion, strict=True)))
    poses, rates = map(np.ascontiguousarray, model.poses(motion.q, motion.v, motion.point))
    forces = Forces(model, motion, poses, rates)
    events, end = prepared.system.events, prepared.solution.end
    laps = tuple(event for event in events if event.kind == "lap" and event.time < end)
    return Result(
        scene=prepared.scene,
        engine="lagrangian",
        settings=_settings(prepared),
        versions=_versions(),
        timings={},
        part_names=tuple(part.name for part in model.mechanism.parts),
        time=time,
        poses=poses,
        rates=rates,
        drive_torques=forces.drive_torques(time),
        drive_forces={},
        joint_forces=forces.joints(),
        slot_forces={model.mechanism.slots[0].name: forces.slot},
        spring_forces={},  # linear springs are refused
        contacts=_contacts(prepared, forces),
        bearings={},
        sleeves=_sleeves(prepared, forces),
        energy=EnergyHistory(*recorder.energies(poses, rates, np.array(kept.totals)).T),
        extremes=recorder.seeker.extremes(),
        laps=laps,
        checks=_checks(prepared),
        warnings=tuple(passed_on(prepared.system.together, "each in turn")),
        outcome=_outcome(prepared, complaint),
    )


def _versions() -> dict[str, str]:
    versions = {"scipy": scipy.__version__, "numpy": np.__version__, "python": python_version()}
    return versions | ({"numba": version()} if version() else {})


def _settings(prepared: Prepared) -> dict[str, float | str]:
    explicit = isinstance(prepared.stepper, ExplicitStepper)
    return {
        "integrator": "DOP853" if explicit else "Radau IIA of order 9",
        "tolerance": prepared.tolerance,
    }


def _contacts(prepared: Prepared, forces: Forces) -> dict[str, ContactHistory]:
    histories = {}
    for k, contact in enumerate(prepared.model.mechanism.contacts):
        at = approach(contact, forces.poses, forces.rates)
        touches = Intervals.of(_intervals(prepared, k))
        histories[contact.name] = ContactHistory(
            at.gap, at.place, forces.motion.forces[:, k], touches
        )
    return histories


def _intervals(prepared: Prepared, k: int) -> Iterator[Interval]:
    """Intervals of contact k, with what its steps show of its force and how deep it went."""
    problem, seeker = prepared.problem, prepared.recorder.seeker
    for interval in prepared.system.intervals(problem.time, problem.state, k):
        force, depth = seeker.peaks(k, interval.begin, interval.end)
        peak = max(interval.peak_force, force)
        yield replace(interval, peak_force=peak, penetration=depth)


def _sleeves(prepared: Prepared, forces: Forces) -> dict[str, SleeveHistory]:
    pressing = forces.walls[0][:, :, PRESS]
    return {walls.channel.name: walls.history(pressing) for walls in prepared.system.walls}


def _checks(prepared: Prepared) -> Checks:
    recorder = prepared.recorder
    deepest = float(recorder.seeker.deepest.max(initial=0.0))
    deepest = max(recorder.largest_penetration, deepest)
    stepper, growing = prepared.stepper, prepared.problem.instability.growth
    # Explicit steps are far more accurate than asked.
    explicit = isinstance(stepper, ExplicitStepper)
    ringing = 0.0 if explicit else growing.ringing(prepared.problem.time, stepper.steps)
    return checks(stepper, recorder, deepest, growing.e_folds, ringing)


def _outcome(prepared: Prepared, complaint: str) -> Outcome:
    system, time = prepared.system, prepared.problem.time
    if prepared.asked.is_set():
        return Outcome(False, time, INTERRUPTED)
    if system.stop_reason:
        return Outcome(False, time, system.stop_reason, system.stop_advice)
    if complaint:
        recorder = prepared.recorder
        gross = recorder.energy_residual > recorder.largest_kinetic_energy
        return Outcome(False, time, complaint, f"{TIGHTEN}{ADVICE}" if gross else ADVICE)
    left = system.left(time, prepared.problem.state)
    return of_turns(prepared.scene, prepared.model.mechanism, time, left)
