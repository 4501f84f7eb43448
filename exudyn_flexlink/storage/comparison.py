"""A comparison to files: what was found, and the deviation over time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.comparison import Comparison, Seen, Statistics, StrikePair
from exudyn_flexlink.measured_error import ForceDeviation
from exudyn_flexlink.observables import Deviation, Measure, Strike
from exudyn_flexlink.storage.documents import write_document
from exudyn_flexlink.storage.errors import COMPARISON
from exudyn_flexlink.storage.writing import contact_data, peak_data, strike_data


def save_comparison(
    comparison: Comparison, folder: Path, tolerance: float | None = None, *, whole: bool = True
) -> None:
    """Write ``comparison.json`` and ``comparison.csv`` into an existing folder.

    `tolerance` (m) is what the deviation up to the horizon was held against, if anything; `whole`
    tells whether all runs were made, also those that tell the errors.

    Raises:
        OSError: the folder can't be written.

    """
    ended = all(seen.result.outcome.completed for seen in comparison.both)
    completed = {"completed": whole and ended}
    data = comparison_data(comparison) | completed | _verdict(comparison, tolerance)
    write_document(folder, COMPARISON, data, {"comparison.csv": comparison_columns(comparison)})


def comparison_columns(comparison: Comparison) -> dict[str, FloatArray]:
    """Instants, deviation, the watched point and the levers of both runs, by name and unit."""
    columns = {"t_s": comparison.time, "deviation_m": comparison.deviation.distance}
    for seen in comparison.both:
        name = seen.name.replace(" ", "_")
        columns |= {f"{name}_{axis}_m": seen.position[:, i] for i, axis in enumerate("xy")}
        columns |= {
            f"{name}_{body}_{seen.levers[body].measure.name}": values
            for body, values in seen.answers.items()
        }
    return columns


def comparison_data(comparison: Comparison) -> dict[str, Any]:
    """Return what was found as plain data: SI numbers, units in the names."""
    return {
        "title": comparison.second.result.scene.title,
        "point": comparison.point,
        "judged_by": list(comparison.judged_by),
        "end_s": comparison.time[-1],
        "horizon_s": comparison.horizon,
        "first_strike_s": comparison.first_strike,
        "deviation": {
            "up_to_the_first_strike": _deviation(comparison.before_strike),
            "up_to_the_horizon": _deviation(comparison.judged),
            "whole_run": _deviation(comparison.deviation),
        },
        "forces_up_to_the_horizon": {name: _force(own) for name, own in comparison.forces.items()},
        "levers": {
            body: {
                f"largest_difference_{comparison.measures[body].unit}": float(np.abs(apart).max()),
                comparison.first.name: peak_data(comparison.first.levers[body]),
                comparison.second.name: peak_data(comparison.second.levers[body]),
            }
            for body, apart in comparison.answer_differences.items()
        },
        "beyond_the_horizon": _beyond(comparison),
        "strikes": [_strikes(comparison, pair) for pair in comparison.strikes],
        "clearances": {joint: _contacts(comparison, joint) for joint in comparison.with_clearance},
        "runs": {seen.name: _run(seen) for seen in comparison.both},
    }


def _verdict(comparison: Comparison, tolerance: float | None) -> dict[str, Any]:
    if tolerance is None:
        return {"tolerance_m": None}
    return {"tolerance_m": tolerance, "exceeded": comparison.exceeds(tolerance)}


def _deviation(part: Deviation | None) -> dict[str, float] | None:
    if part is None or not len(part.time):
        return None
    at = float(part.time[int(part.distance.argmax())])
    return {"largest_m": part.largest, "largest_at_s": at, "rms_m": part.rms}


def _force(own: ForceDeviation) -> dict[str, Any]:
    """How far a force is apart, in its unit; None where the runs have no such instant."""
    parts = {"free": own.free, "in_contact": own.touching}
    return {
        "unit": own.unit,
        **{
            when: None if part is None else {**vars(part), "relative": part.relative}
            for when, part in parts.items()
        },
    }


def _beyond(comparison: Comparison) -> dict[str, Any] | None:
    if comparison.beyond is None:
        return None
    return {
        seen.name: _statistics(part, comparison.measures)
        for seen, part in zip(comparison.both, comparison.beyond, strict=True)
    }


def _statistics(part: Statistics, measures: Mapping[str, Measure]) -> dict[str, Any]:
    keys = ("mean", "rms", "least", "greatest")
    levers = {f"{body}_{measures[body].name}": list(own) for body, own in part.levers.items()}
    return {f"{key}_m": getattr(part, key).tolist() for key in keys} | levers


def _strikes(comparison: Comparison, pair: StrikePair) -> dict[str, Any]:
    return {
        "contact": pair.contact,
        **({} if pair.lap is None else {"lap": pair.lap}),
        comparison.first.name: _strike(comparison.first, pair.first),
        comparison.second.name: _strike(comparison.second, pair.second),
    }


def _strike(seen: Seen, strike: Strike | None) -> dict[str, Any] | None:
    return None if strike is None else strike_data(strike, seen.result.scene)


def _contacts(comparison: Comparison, joint: str) -> dict[str, Any]:
    """Contacts of a link with its guide in both runs; None in one without clearance."""
    found = {seen.name: seen.contact.get(joint) for seen in comparison.both}
    return {name: None if own is None else contact_data(own) for name, own in found.items()}


def _run(seen: Seen) -> dict[str, Any]:
    result = seen.result
    return {
        "engine": result.engine,
        "settings": result.settings,
        "impacts": list(seen.impacts),
        "completed": result.outcome.completed,
        "end_s": result.outcome.time,
        "energy_residual_J": result.checks.energy_residual,
        "relative_energy_residual": result.checks.relative_energy_residual,
        "steps": result.checks.steps,
        "wall_time_s": dict(result.timings),
    }
