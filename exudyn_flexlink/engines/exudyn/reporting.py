"""What both ways of running a scene in Exudyn give back, and how it becomes a Result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from platform import python_version

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.engine import version
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import Assembly, Mechanism, least_tolerance
from exudyn_flexlink.result import (
    Checks,
    ContactHistory,
    EnergyHistory,
    Event,
    Extremes,
    Outcome,
    Result,
    SleeveHistory,
)
from exudyn_flexlink.scene import Scene

NO_SOLUTION = "the solver found no solution even with its smallest step"
SHORT_ENOUGH = 1e-10  # s: a step that no contact or track asks to be shorter
NEAR_ROUNDING = 1e3  # times the least tolerance: from there on it is no help to tighten one
NO_VALUE_ADVICE = "mend the expression: min and max, or where(t < 1, one, other), keep it in bounds"
LOCKED_ADVICE = "look at the mechanism there; start elsewhere, or change lengths so that it passes"


@dataclass(frozen=True)
class Report:
    """The part of a Result that the samples decide; shapes as there."""

    settings: Mapping[str, float | str]
    time: FloatArray
    poses: FloatArray
    rates: FloatArray
    drive_torques: Mapping[str, FloatArray]
    drive_forces: Mapping[str, FloatArray]
    joint_forces: Mapping[str, FloatArray]
    slot_forces: Mapping[str, FloatArray]
    spring_forces: Mapping[str, FloatArray]
    contacts: Mapping[str, ContactHistory]
    bearings: Mapping[str, ContactHistory]
    sleeves: Mapping[str, SleeveHistory]
    energy: EnergyHistory
    extremes: Mapping[str, Extremes]
    laps: tuple[Event, ...]
    checks: Checks


def no_solution_advice(
    assembly: Assembly, tolerance: float | None, shortest: float = 0.0, time: float = 0.0
) -> str:
    """Say what to try where no step was short enough.

    `tolerance` (m) is that of the run, None with steps of the user's own. `shortest` (s) is the
    shortest step that is made at the `time` (s) that the run has come to.
    """
    if shortest > SHORT_ENOUGH:
        return (
            f"shorten the run: at {time:.3g} s no step below {shortest:.2g} s is made, which may "
            "be too long for what happens there"
        )
    if tolerance is None:
        knob = "shorten the step, "
    elif tolerance < NEAR_ROUNDING * least_tolerance(assembly):
        knob = f"loosen the tolerance: {tolerance:g} m is near what rounding allows; else "
    else:
        knob = "tighten the tolerance, "
    contacts = assembly.mechanism.contacts
    if contacts and all(isinstance(contact.law, Impulse) for contact in contacts):
        soften = "give the contact a law with stiffness"
    else:
        soften = "soften the contact (less stiffness or friction, or a larger transition_speed)"
    return f"{knob}{soften}, or look at the mechanism there: it may be about to lock"


def result_of(
    scene: Scene,
    mechanism: Mechanism,
    report: Report,
    warnings: Sequence[str],
    outcome: Outcome,
) -> Result:
    """Put the Result together; its timings are still to come."""
    return Result(
        scene=scene,
        engine="exudyn",
        versions={"exudyn": version(), "numpy": np.__version__, "python": python_version()},
        timings={},
        part_names=tuple(part.name for part in mechanism.parts),
        warnings=tuple(warnings),
        outcome=outcome,
        **vars(report),
    )
